"""Vertical and floor, from the upright body and from standing feet."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import rotation_between
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.model.human.anthropometry import ANKLE_HEIGHT, TOE_HEIGHT
from studio.engine.model.joints import INDEX

_FEET = {
    "left_ankle": ANKLE_HEIGHT,
    "right_ankle": ANKLE_HEIGHT,
    "left_toe": TOE_HEIGHT,
    "right_toe": TOE_HEIGHT,
}
_STANCE_SPEED_M_S = 0.35
_OTHER_FOOT_M = 0.04
_UP_PRIOR_SD = np.radians(1.0)
_HEIGHT_PRIOR_SD_M = 0.015
_INDEPENDENT_SHARE = 0.02
_MIN_UPRIGHT = 10
_MIN_STANDING = 10
_MIN_BODY_M = 0.1


@dataclass(frozen=True)
class Floor:
    """The floor in the frame of the walk: points p on it have up @ p = height_m."""

    up: NDArray[np.float64]
    height_m: float


def body_up(walk: Walk) -> NDArray[np.float64] | None:
    """Return the mean direction of the upright body; None where no legs or trunk were seen."""
    joints = walk.sure()
    feet = (joints[:, INDEX["left_ankle"]] + joints[:, INDEX["right_ankle"]]) / 2
    for bottom in (feet, joints[:, INDEX["hips"]]):
        direction = joints[:, INDEX["neck"]] - bottom
        direction = direction[np.linalg.norm(direction, axis=1) > _MIN_BODY_M]  # NaN compares as False
        if len(direction) >= _MIN_UPRIGHT:
            break
    else:
        return None
    unit = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    mean = np.median(unit, axis=0)
    for _ in range(10):  # upright most of the time: bows and squats lose their weight
        weight = (1.0 + ((1.0 - unit @ (mean / np.linalg.norm(mean))) / 0.03) ** 2) ** -2
        mean = weight @ unit / weight.sum()
    return mean / np.linalg.norm(mean)


def find_floor(walk: Walk, height_m: float) -> Floor | None:
    """Return the floor under standing feet; None where feet or body were not seen.

    A foot stands when it is slow and not higher than the other one. A plane is fitted robustly to the standing
    ankles and toes, each at its height in the foot (known to 1.5 cm), with a prior of 1 degree around
    the body's mean upright.

    Args:
        walk: the calibration part in any one frame.
        height_m: the performer's standing height [m].
    """
    up = body_up(walk)
    if up is None:
        return None
    smooth, joints = walk.smooth(), walk.sure()
    rate_hz = 1.0 / float(np.median(np.diff(walk.times_s)))
    points, kinds = [], []
    for kind, name in enumerate(_FEET):
        mine, other = smooth[:, INDEX[name]], smooth[:, INDEX[_other_side(name)]]
        speed = np.linalg.norm(np.gradient(mine, axis=0), axis=1) * rate_hz
        standing = (speed < _STANCE_SPEED_M_S) & ((mine - other) @ up < _OTHER_FOOT_M)
        standing &= np.isfinite(joints[:, INDEX[name], 0])
        points.append(joints[standing, INDEX[name]])
        kinds.append(np.full(int(standing.sum()), kind))
    feet = np.concatenate(points)
    if len(feet) < _MIN_STANDING:
        return None
    return _fit_plane(feet, np.concatenate(kinds), np.array(list(_FEET.values())) * height_m, up)


def _other_side(name: str) -> str:
    side, joint = name.split("_")
    return f"{'right' if side == 'left' else 'left'}_{joint}"


def _fit_plane(
    feet: NDArray[np.float64], kinds: NDArray[np.int64], usual_m: NDArray[np.float64], up: NDArray[np.float64]
) -> Floor:
    """Return the plane under standing foot joints.

    Unknowns: slope along two axes, height, and the deviation of each kind of joint from its usual height.

    Args:
        feet: joints [m], shape (count, 3); kinds: which of the foot joints each is, shape (count,).
        usual_m: usual height of each kind over the floor [m], shape (kind_count,).
        up: first guess, unit vector.
    """
    to_up = rotation_between(np.array([0.0, 0.0, 1.0]), up)
    local = feet @ to_up  # z is up
    centre = np.median(local, axis=0)
    own = np.eye(len(usual_m))[kinds]
    A = np.column_stack([local[:, :2] - centre[:2], np.ones(len(local)), own])
    prior = np.array([_UP_PRIOR_SD, _UP_PRIOR_SD, np.inf, *(_HEIGHT_PRIOR_SD_M,) * len(usual_m)]) ** -2.0
    h = local[:, 2] - usual_m[kinds]
    solution = np.zeros(A.shape[1])
    solution[2] = np.median(h)
    for _ in range(20):
        residual = h - A @ solution
        scale = max(1.48 * float(np.median(np.abs(residual))), 0.005)
        weight = (1.0 + (residual / (2.5 * scale)) ** 2) ** -2 / scale**2 * _INDEPENDENT_SHARE
        normal = (A * weight[:, None]).T @ A + np.diag(prior)
        solution = np.linalg.solve(normal, (A * weight[:, None]).T @ h)
    upright = np.array([-solution[0], -solution[1], 1.0])
    upright /= np.linalg.norm(upright)
    on_floor = np.array([centre[0], centre[1], solution[2]])
    return Floor(to_up @ upright, float(upright @ on_floor))
