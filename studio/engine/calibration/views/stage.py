"""The stage frame of ordinary cameras: vertical and floor from the upright body and standing feet, scale from the
performer's height."""

import numpy as np

from studio.engine.base.geometry import make_transform, transform_points
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.calibration.performer.stage import find_stage
from studio.engine.calibration.views.seen.bodies import USUAL_HEIGHT_M, Array, known_of
from studio.engine.calibration.views.seen.view import COLUMNS
from studio.engine.model.calibration import Performer
from studio.engine.model.joints import JOINT_COUNT, on_trunk


def canonical(joints: Array) -> Array:
    """Return joints of `view.JOINTS`, shape (..., 17, 3), as canonical ones, shape (..., 21, 3).

    Hips and neck are at their usual places in a trunk; spine and chest are NaN.
    """
    out = np.full((*joints.shape[:-2], JOINT_COUNT, 3), np.nan)
    out[..., COLUMNS, :] = joints
    return on_trunk(out)


def to_stage(
    times_s: Array, joints: Array, height_m: float | None
) -> tuple[Array, float, Array, Performer | None]:
    """Return the stage of joints in any one frame and of any size.

    Args:
        times_s: instants [s], shape (instant_count,).
        joints: of `view.JOINTS`, shape (instant_count, 17, 3).
        height_m: the performer's; None = the usual one.

    Returns:
        T_stage_frame; the factor by which points are multiplied before it is applied; the canonical joints on the
        stage [m], shape (instant_count, 21, 3); the performer.
    """
    whole = canonical(joints)
    size = 1.0
    T, performer = np.eye(4), None
    for _ in range(3):  # the measured height depends a little on the floor
        T, performer, _ = find_stage(_walk(times_s, whole * size))
        if performer is None:
            break
        size *= (height_m or USUAL_HEIGHT_M) / performer.height_m
    T, performer, _ = find_stage(_walk(times_s, whole * size))
    return T, size, transform_points(T, whole * size), performer


def _walk(times_s: Array, joints: Array) -> Walk:
    """Return joints as a walk seen by one certain camera."""
    known = known_of(joints)
    return Walk(times_s, joints[None], known[None].astype(np.float64), joints)


def camera_on_stage(T: Array, size: float, turn: Array, shift: Array) -> Array:
    """Return T_stage_camera of a rig's camera, for points multiplied by `size` and then moved by `T`."""
    return T @ make_transform(turn.T, -turn.T @ shift * size)
