"""Feet that stand on the floor and step after a walking or turning body."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.keys import ease

_CYCLE_S = 1.1
_SWING_S = 0.46
_HEEL_RISE_S = 0.26  # before the foot leaves the floor
_LIFT_M = 0.055
_HEEL_RISE = 0.55  # rad at a step of full length
_FULL_STEP_M = 0.5


@dataclass(frozen=True)
class Feet:
    """Both feet over time; left, then right.

    Attributes:
        toes_m: position of the toe joints, without the height of a standing toe, shape (F, 2, 3).
        yaws: headings of the feet, shape (F, 2).
        pitches: heel up is positive, shape (F, 2).
    """

    toes_m: NDArray[np.float64]
    yaws: NDArray[np.float64]
    pitches: NDArray[np.float64]


def step_after(
    times_s: NDArray[np.float64],
    place: NDArray[np.float64],
    yaw: NDArray[np.float64],
    toes_m: NDArray[np.float64],
    splay: float = 0.12,
) -> Feet:
    """Return feet that step under a moving body.

    Args:
        times_s: shape (F,), evenly spaced.
        place: the body's position over the floor [m], shape (F, 2).
        yaw: its heading, shape (F,).
        toes_m: toe joints under a body at the origin that faces -y [m], left then right, shape (2, 2).
        splay: outward angle of the feet [rad].
    """
    tracks = [
        _one_foot(
            times_s, place, yaw, toes_m[foot], start_s=foot * _CYCLE_S / 2, outwards=(splay, -splay)[foot]
        )
        for foot in range(2)
    ]
    toes, yaws, pitches = (np.stack([track[i] for track in tracks], axis=1) for i in range(3))
    return Feet(toes, yaws, pitches)


def turn_z(yaw: NDArray[np.float64], vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a vector's x and y turned about z by each yaw, shape (F, 2)."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.stack(
        [c * vector[..., 0] - s * vector[..., 1], s * vector[..., 0] + c * vector[..., 1]], axis=-1
    )


def _one_foot(
    times: NDArray[np.float64],
    place: NDArray[np.float64],
    yaw: NDArray[np.float64],
    toe: NDArray[np.float64],
    *,
    start_s: float,
    outwards: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    targets = place + turn_z(yaw, toe)
    print_xy, print_yaw = targets[0], float(yaw[0])
    toes = np.zeros((len(times), 3))
    toes[:, :2] = print_xy
    yaws = np.full(len(times), print_yaw)
    pitches = np.zeros(len(times))
    for lift_s in np.arange(start_s, times[-1], _CYCLE_S):
        # the footprint lies under the body in the middle of the next stance
        middle = int(np.searchsorted(times, lift_s + _SWING_S + (_CYCLE_S - _SWING_S) / 2))
        middle = min(middle, len(times) - 1)
        new_xy, new_yaw = targets[middle], float(yaw[middle])
        way = float(np.hypot(*(new_xy - print_xy)))
        if way < 0.004 and abs(new_yaw - print_yaw) < 0.01:
            continue
        share = (times - lift_s) / _SWING_S
        swing = ease(share)
        strength = min(1.0, way / _FULL_STEP_M)
        moving = share > 0
        toes[moving, :2] = (print_xy + (new_xy - print_xy) * swing[:, None])[moving]
        yaws[moving] = (print_yaw + (new_yaw - print_yaw) * swing)[moving]
        inside = (share > 0) & (share < 1)
        toes[inside, 2] = _LIFT_M * (0.5 + 0.5 * strength) * np.sin(np.pi * share[inside]) ** 2
        rise = ease((times - lift_s + _HEEL_RISE_S) / _HEEL_RISE_S) * (1 - ease((share - 0.1) / 0.75))
        pitches += _HEEL_RISE * strength * rise
        print_xy, print_yaw = new_xy, new_yaw
    return toes, yaws + outwards, pitches
