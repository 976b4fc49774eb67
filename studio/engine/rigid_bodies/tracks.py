"""The motion of rigid bodies over a take, and the place of each at any time."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.quaternions import continuous_signs, normalized
from studio.engine.rigid_bodies.known import BodyPlace
from studio.engine.rigid_bodies.reading import BodyAxes, BodyReading, to_stage_axes

MOST_GAP_S = 0.25
"""Longest time between two readings over which a body's place is known."""


@dataclass(frozen=True)
class BodyTrack:
    """The motion of a body, in axes with z up.

    Attributes:
        time_s: stage time of each reading [s], shape (n,), increasing.
        positions_m: shape (n, 3).
        rotations_wxyz: shape (n, 4), signs continuous.
    """

    time_s: NDArray[np.float64]
    positions_m: NDArray[np.float64]
    rotations_wxyz: NDArray[np.float64]

    def at(self, time_s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return places, shape (m, 3), and rotations, shape (m, 4), at other times; NaN = unknown."""
        positions, rotations = self.filled_at(time_s)
        after = np.clip(np.searchsorted(self.time_s, time_s), 1, max(len(self.time_s) - 1, 1))
        if len(self.time_s) < 2:
            unknown = np.ones(len(time_s), bool)
        else:
            unknown = self.time_s[after] - self.time_s[after - 1] > MOST_GAP_S
            unknown |= (time_s < self.time_s[0]) | (time_s > self.time_s[-1])
        positions[unknown] = rotations[unknown] = np.nan
        return positions, rotations

    def filled_at(self, time_s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the same without gaps: interpolated in them, and standing still beyond the ends."""
        positions = _between(time_s, self.time_s, self.positions_m)
        return positions, normalized(_between(time_s, self.time_s, self.rotations_wxyz))

    def placed(self, place: BodyPlace) -> "BodyTrack":
        """Return the motion in the stage frame."""
        positions, rotations = place.moved(self.positions_m, self.rotations_wxyz)
        return BodyTrack(self.time_s, positions, continuous_signs(rotations))

    def later(self, seconds: float) -> "BodyTrack":
        """Return the motion with later times."""
        return BodyTrack(self.time_s + seconds, self.positions_m, self.rotations_wxyz)


def _between(
    time_s: NDArray[np.float64], known_s: NDArray[np.float64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.stack([np.interp(time_s, known_s, column) for column in values.T], axis=1)


@dataclass(frozen=True)
class BodyTracks:
    """The rigid bodies of a take by name, in their own system, with z up.

    Attributes:
        tracks: their motion.
        on_stage: names of those that the studio's cameras saw, which are in the stage frame and on its clock.
    """

    tracks: Mapping[str, BodyTrack] = field(default_factory=dict)
    on_stage: frozenset[str] = frozenset()

    def placed(self, place: BodyPlace, later_s: float = 0.0) -> "BodyTracks":
        """Return them in the stage frame, with later times."""
        return BodyTracks(
            {
                name: one if name in self.on_stage else one.placed(place).later(later_s)
                for name, one in self.tracks.items()
            },
            self.on_stage,
        )


def tracks_of(readings: Iterable[tuple[float, BodyAxes, BodyReading]]) -> BodyTracks:
    """Return the tracks of readings at stage times [s], each in the axes of its system; lost ones are left out."""
    found: dict[str, list[tuple[float, BodyAxes, BodyReading]]] = {}
    for one in readings:
        if one[2].tracked:
            found.setdefault(one[2].name, []).append(one)
    tracks = {}
    for name, mine in found.items():
        mine.sort(key=lambda one: one[0])
        times = np.array([time_s for time_s, _, _ in mine])
        positions = np.array([one.position_m for _, _, one in mine])
        rotations = np.array([one.rotation_xyzw for _, _, one in mine])
        positions, rotations = to_stage_axes(positions, rotations, mine[-1][1])
        kept = np.concatenate([[True], np.diff(times) > 0])
        turns = continuous_signs(normalized(rotations[kept]))
        tracks[name] = BodyTrack(times[kept], positions[kept], turns)
    return BodyTracks(tracks)
