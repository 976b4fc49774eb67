"""Up and floor, from the upright body and from feet that stand; and the stage frame on them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.merge import Walk
from studio.engine.geometry import make_transform, rotation_between
from studio.engine.joints import INDEX

ANKLE_HEIGHT = 0.046
TOE_HEIGHT = 0.018
"""Heights of the ankle's and the ball of the foot's centre over the floor, as shares of the standing height.

Source: Winter, "Biomechanics and motor control of human movement", 4th edition, figure 4.1 (ankle 0.039 H
without shoes), with 1 cm for a shoe's sole at 1.75 m.
"""
_STANCE_SPEED_M_S = 0.35
_UP_PRIOR_SD = np.radians(2.0)
_FEET = (("ankle", ANKLE_HEIGHT), ("toe", TOE_HEIGHT))


@dataclass(frozen=True)
class Floor:
    """The floor in the frame of the walk: points p on it have up @ p = height_m.

    `tilt_sd_rad` says how sure the up direction is; `stance_count` how many foot placements it rests on.
    """

    up: NDArray[np.float64]
    height_m: float
    stance_count: int


def body_up(walk: Walk) -> NDArray[np.float64] | None:
    """Return the direction in which the body stands, on average; None where no legs or trunk were seen."""
    joints = walk.merged
    feet = (
        np.nanmean(joints[:, [INDEX["left_ankle"], INDEX["right_ankle"]]], axis=1)
        if len(joints)
        else joints[:, 0]
    )
    top = joints[:, INDEX["neck"]]
    direction = top - feet
    seen = np.isfinite(direction).all(axis=1)
    if seen.sum() < 10:
        direction = top - joints[:, INDEX["hips"]]
        seen = np.isfinite(direction).all(axis=1)
    if seen.sum() < 10:
        return None
    unit = direction[seen] / np.linalg.norm(direction[seen], axis=1, keepdims=True)
    mean = np.median(unit, axis=0)
    for _ in range(10):  # most of the time upright: bows and squats lose their weight
        weight = (1.0 + ((1.0 - unit @ (mean / np.linalg.norm(mean))) / 0.03) ** 2) ** -2
        mean = weight @ unit / weight.sum()
    return mean / np.linalg.norm(mean)


def find_floor(walk: Walk, height_m: float) -> Floor | None:
    """Return the floor under the feet that stand.

    A foot stands when it is slow and not higher than the other one; a plane is fitted robustly to the standing
    feet's joints lowered by their heights in the foot, and held near the body's mean upright by a prior of 2 degrees.

    Args:
        walk: the calibration part in any one frame.
        height_m: the performer's standing height [m].
    """
    up = body_up(walk)
    if up is None:
        return None
    smooth = walk.smooth()
    rate = 1.0 / np.median(np.diff(walk.times_s))
    points, height_of = [], []
    for joint, share in _FEET:
        left, right = smooth[:, INDEX[f"left_{joint}"]], smooth[:, INDEX[f"right_{joint}"]]
        for name, mine, other in ((f"left_{joint}", left, right), (f"right_{joint}", right, left)):
            speed = np.linalg.norm(np.gradient(mine, axis=0), axis=1) * rate
            standing = (speed < _STANCE_SPEED_M_S) & ((mine - other) @ up < 0.04)
            standing &= np.isfinite(walk.merged[:, INDEX[name], 0])
            points.append(walk.merged[standing, INDEX[name]])
            height_of.append(np.full(int(standing.sum()), share * height_m))
    feet, lowered = np.concatenate(points), np.concatenate(height_of)
    if len(feet) < 10:
        return None
    return _fit_plane(feet, lowered, up)


def _fit_plane(feet: NDArray[np.float64], lowered: NDArray[np.float64], up: NDArray[np.float64]) -> Floor:
    """Return the plane under foot joints, shape (count, 3), each `lowered` by its height over the floor [m]."""
    to_up = rotation_between(np.array([0.0, 0.0, 1.0]), up)
    local = feet @ to_up  # z is up
    centre = np.median(local, axis=0)
    A = np.column_stack([local[:, 0] - centre[0], local[:, 1] - centre[1], np.ones(len(local))])
    h = local[:, 2] - lowered
    solution = np.array([0.0, 0.0, np.median(h)])
    for _ in range(20):
        residual = h - A @ solution
        scale = max(1.48 * float(np.median(np.abs(residual))), 0.005)
        weight = (1.0 + (residual / (2.5 * scale)) ** 2) ** -2 / scale**2 * 0.1
        normal = (A * weight[:, None]).T @ A
        normal[0, 0] += 1.0 / _UP_PRIOR_SD**2
        normal[1, 1] += 1.0 / _UP_PRIOR_SD**2
        solution = np.linalg.solve(normal, (A * weight[:, None]).T @ h)
    normal_local = np.array([-solution[0], -solution[1], 1.0])
    normal_local /= np.linalg.norm(normal_local)
    on_floor = np.array([centre[0], centre[1], solution[2]])
    return Floor(to_up @ normal_local, float(normal_local @ on_floor), len(feet))


def stage_from_walk(
    up: NDArray[np.float64], height_m: float, hips: NDArray[np.float64], forward: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return T_stage_walk: z up from the floor, origin under `hips`, `forward` along -y (all in the walk's frame)."""
    z = up / np.linalg.norm(up)
    y = -(forward - (forward @ z) * z)
    y /= np.linalg.norm(y)
    rotation = np.array([np.cross(y, z), y, z])
    origin = hips - (hips @ z - height_m) * z
    return make_transform(rotation, -rotation @ origin)
