"""Key reduction: curves for editing, with a bound on the movement of every joint."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.curves.euler import from_euler
from studio.engine.animation.curves.keys import CurveKeys, fitted_keys, values_between
from studio.engine.base.quaternions import multiply, rotate

Place = tuple[int, str]
"""(joint, `Translation` or `Rotation`)."""

_CM = 100.0
_LARGEST_TURN_DEG = 0.25
_SHORTEST_REACH_CM = 3.0
_ROUNDS = 8
_CHUNK = 2048


@dataclass(frozen=True)
class Tracks:
    """The channels of a take.

    Attributes:
        values: (joint, channel) -> x, y, z per frame [cm or deg], shape (frame_count, 3).
        orders: rotation order of each joint.
        before_wxyz: rotation of each joint ahead of its channel, shape (joint_count, 4).
        motion: the take.
    """

    values: dict[Place, NDArray[np.float64]]
    orders: tuple[str, ...]
    before_wxyz: NDArray[np.float64]
    motion: LocalMotion


def reduced_keys(
    tracks: Tracks, error_cm: float, interpolation: str, progress: Callable[[float], None]
) -> dict[Place, list[CurveKeys]]:
    """Return keys with which no joint moves by more than `error_cm` in any frame.

    A channel's first tolerance is the bound divided by the joint's reach. The joints' positions are then measured
    in every frame, and all tolerances are lowered until the bound holds.

    Args:
        tracks: the channels.
        error_cm: largest movement of a joint [cm].
        interpolation: `cubic` or `linear`.
        progress: receives the share done.
    """
    motion = tracks.motion
    rate, count = motion.frames_per_second, motion.frame_count
    truth = _places(tracks, tracks.values)
    tolerances = _tolerances(tracks, error_cm)
    scale = 0.5
    for round_ in range(_ROUNDS):
        keys = {
            place: [
                fitted_keys(track[:, axis], rate, scale * tolerances[place], interpolation)
                for axis in range(3)
            ]
            for place, track in tracks.values.items()
        }
        back = {
            place: np.stack([values_between(curve, count, rate) for curve in three], axis=1)
            for place, three in keys.items()
        }
        worst = max(
            float(np.linalg.norm(a - b, axis=-1).max())
            for a, b in zip(_places(tracks, back), truth, strict=True)
        )
        progress((round_ + 1) / _ROUNDS)
        if worst <= error_cm:
            return keys
        scale *= max(0.2, 0.95 * error_cm / worst)
    return {  # the bound is below the resolution of a file's numbers
        place: [fitted_keys(track[:, axis], rate, 0.0, interpolation) for axis in range(3)]
        for place, track in tracks.values.items()
    }


def _tolerances(tracks: Tracks, error_cm: float) -> dict[Place, float]:
    """Return each channel's share of the bound [cm or deg]."""
    rest = tracks.motion.rest_positions_m * _CM
    reach = np.full(len(rest), _SHORTEST_REACH_CM)
    for joint, _ in enumerate(rest):
        up = int(tracks.motion.parents[joint])
        while up >= 0:
            reach[up] = max(reach[up], float(np.linalg.norm(rest[joint] - rest[up])))
            up = int(tracks.motion.parents[up])
    return {
        (joint, channel): error_cm
        if channel == "Translation"
        else min(float(np.degrees(error_cm / reach[joint])), _LARGEST_TURN_DEG)
        for joint, channel in tracks.values
    }


def _places(tracks: Tracks, values: dict[Place, NDArray[np.float64]]) -> list[NDArray[np.float32]]:
    """Return world positions of all joints [cm] in chunks of frames, each of shape (frames, joint_count, 3)."""
    motion = tracks.motion
    joints = len(motion.parents)
    out = []
    for start in range(0, motion.frame_count, _CHUNK):
        frames = slice(start, min(start + _CHUNK, motion.frame_count))
        places = np.empty((frames.stop - frames.start, joints, 3), np.float32)
        world: list[NDArray[np.float64]] = []
        for joint in range(joints):
            own = multiply(
                tracks.before_wxyz[joint], from_euler(values[joint, "Rotation"][frames], tracks.orders[joint])
            )
            keys = values.get((joint, "Translation"))
            offset = motion.offsets_m[joint] * _CM if keys is None else keys[frames]
            above = int(motion.parents[joint])
            if above < 0:
                places[:, joint] = offset
            else:
                places[:, joint] = places[:, above] + rotate(world[above], offset)
                own = multiply(world[above], own)
            world.append(own)
        out.append(places)
    return out
