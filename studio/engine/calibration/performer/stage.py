"""The stage frame and the performer on it, from the walk in the reference camera's frame."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import make_transform
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.calibration.performer.depth_floor import is_floor
from studio.engine.calibration.performer.floor import Floor, body_up, find_floor
from studio.engine.calibration.performer.proportions import measure
from studio.engine.calibration.performer.soles import on_soles
from studio.engine.calibration.performer.tpose import ACROSS_BODY, ACROSS_TPOSE, facing, find_tpose
from studio.engine.model.calibration import Performer
from studio.engine.model.joints import INDEX

_USUAL_HEIGHT_M = 1.75
_EYE_LEVEL_M = 1.2
_FIRST_INSTANTS = 30
_UPRIGHT_CAMERA = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def find_stage(walk: Walk, seen: Floor | None = None) -> tuple[NDArray[np.float64], Performer | None, bool]:
    """Return T_stage_walk, the performer, and whether he stands on the floor that was seen.

    The origin is the floor under the hips in the T-pose, where the performer faces -y; without a T-pose it is under
    the middle of the walk, facing as at its start. If no body was seen, the stage is that of an upright camera at
    eye level, and there is no performer.

    Args:
        walk: in any one frame.
        seen: the floor seen by depth cameras, in the same frame; it replaces the one under the feet, unless
            they are so far apart that it is another plane.
    """
    up = body_up(walk)
    if up is None:
        return make_transform(_UPRIGHT_CAMERA, np.array([0.0, 0.0, _EYE_LEVEL_M])), None, False
    T, performer, height, floor = np.eye(4), None, _USUAL_HEIGHT_M, seen
    for _ in range(
        2
    ):  # heights of ankles and toes follow from the performer's height, and this from the floor
        floor = find_floor(walk, height) or Floor(up, _lowest(walk, up))
        if seen is not None and is_floor(seen, floor, middle_of(walk)):
            floor = seen
        T = _frame(walk, floor)
        performer = measure(walk.moved(T))
        height = height if performer is None else performer.height_m
    if performer is None:
        return T, None, False
    if floor is not seen:  # the floor was placed under the feet
        return T, replace(performer, soles_measured=True), False
    performer = on_soles(performer, walk.moved(T))
    return T, performer, performer.soles_measured


def middle_of(walk: Walk) -> NDArray[np.float64]:
    """Return the middle of the walk in its frame [m], shape (3,); the origin where no hips were seen."""
    hips = walk.merged[:, INDEX["hips"]]
    hips = hips[np.isfinite(hips).all(axis=1)]
    return np.median(hips, axis=0) if len(hips) else np.zeros(3)


def _lowest(walk: Walk, up: NDArray[np.float64]) -> float:
    """Return the lowest extent of the seen joints along `up` [m], for a floor without feet."""
    heights = walk.merged @ up
    return float(np.percentile(heights[np.isfinite(heights)], 1))


def _frame(walk: Walk, floor: Floor) -> NDArray[np.float64]:
    hold, joints = find_tpose(walk, floor.up), walk.sure()
    start, place, across = slice(0, _FIRST_INSTANTS), slice(None), ACROSS_BODY
    if hold is not None:
        start, place, across = hold.frames, hold.frames, ACROSS_TPOSE
    forward = facing(joints[start], floor.up, across)
    if forward is None:
        forward = facing(joints, floor.up, ACROSS_BODY)
    if forward is None:  # neither shoulders nor hips: towards the reference camera
        forward = np.array([0.0, 0.0, -1.0])
    hips = joints[place, INDEX["hips"]]
    hips = hips[np.isfinite(hips).all(axis=1)]
    return stage_from_walk(floor, np.median(hips, axis=0) if len(hips) else np.zeros(3), forward)


def stage_from_walk(
    floor: Floor, hips: NDArray[np.float64], forward: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return T_stage_walk: z up from the floor, origin under `hips`, `forward` along -y.

    Args:
        floor: in the walk's frame, as are `hips` [m], shape (3,), and `forward`, a direction, shape (3,).
    """
    z = floor.up / np.linalg.norm(floor.up)
    y = -(forward - (forward @ z) * z)
    y /= np.linalg.norm(y)
    rotation = np.array([np.cross(y, z), y, z])
    origin = hips - (hips @ z - floor.height_m) * z
    return make_transform(rotation, -rotation @ origin)
