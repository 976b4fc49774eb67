"""Joints of several cameras at common instants: tracks, their clocks, and interpolation within short gaps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import CameraFrame, ClockModel
from studio.engine.model.joints import JOINT_COUNT

MAX_GAP_S = 0.1
"""Longest gap across which joints are interpolated."""

GRID_HZ = 30.0


@dataclass(frozen=True)
class Track:
    """All frames of one camera as arrays.

    Attributes:
        epoch_ns: device time of the first frame.
        times_s: device time since then, shape (frame_count,), strictly increasing.
        positions: camera frame [m], shape (frame_count, 21, 3); NaN = unseen.
        confidence: shape (frame_count, 21).
    """

    epoch_ns: int
    times_s: NDArray[np.float64]
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]

    def until(self, device_s: float) -> "Track":
        """Return the frames up to a device time [s] since the epoch."""
        keep = self.times_s <= device_s
        return Track(self.epoch_ns, self.times_s[keep], self.positions[keep], self.confidence[keep])


@dataclass(frozen=True)
class LocalClock:
    """Maps a track's time to the reference track's: s = u + offset_s + drift * (u - middle_s)."""

    offset_s: float = 0.0
    drift: float = 0.0
    middle_s: float = 0.0

    def device_s(self, reference_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return times on the track's clock from times on the reference track's [s]."""
        return (reference_s - self.offset_s + self.drift * self.middle_s) / (1.0 + self.drift)

    def reference_s(self, device_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return times on the reference track's clock from times on the track's [s]."""
        return device_s + self.offset_s + self.drift * (device_s - self.middle_s)

    def model(self, track: Track, reference: Track) -> ClockModel:
        """Return the clock in device times of whole nanoseconds, with the offset at the track's first frame."""
        first_s = self.offset_s - self.drift * self.middle_s
        return ClockModel(
            offset_ns=reference.epoch_ns - track.epoch_ns + round(first_s * 1e9),
            drift_ppm=self.drift * 1e6,
            reference_ns=track.epoch_ns,
        )


def make_track(frames: Sequence[CameraFrame]) -> Track:
    """Return a camera's frames as arrays; a frame that is not later than the one before is left out."""
    times = np.array([frame.device_time_ns for frame in frames], dtype=np.int64)
    if len(times) == 0:
        return Track(0, np.zeros(0), np.zeros((0, JOINT_COUNT, 3)), np.zeros((0, JOINT_COUNT)))
    keep = np.append(True, times[1:] > np.maximum.accumulate(times)[:-1])
    positions = np.array([frame.positions for frame in frames], dtype=np.float64)[keep]
    confidence = np.array([frame.confidence for frame in frames], dtype=np.float64)[keep]
    unseen = ~np.isfinite(positions).all(axis=2) | (confidence <= 0)
    positions[unseen] = np.nan
    return Track(int(times[0]), (times[keep] - times[0]) * 1e-9, positions, np.where(unseen, 0.0, confidence))


def sample(track: Track, device_s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a track's joints at any times, interpolated linearly between neighbouring frames.

    Args:
        track: the camera's frames.
        device_s: times on the track's clock [s], shape (instant_count,).

    Returns:
        Positions in the camera frame [m], shape (instant_count, 21, 3), NaN outside the track, where a
        neighbouring frame lacks the joint or the gap is longer than `MAX_GAP_S`; confidence, the lower of
        the two frames', shape (instant_count, 21), 0 where NaN.
    """
    if len(track.times_s) < 2:
        shape = (len(device_s), JOINT_COUNT)
        return np.full((*shape, 3), np.nan), np.zeros(shape)
    after = np.clip(np.searchsorted(track.times_s, device_s, side="right"), 1, len(track.times_s) - 1)
    before = after - 1
    gap = track.times_s[after] - track.times_s[before]
    share = (device_s - track.times_s[before]) / gap
    positions = track.positions[before] * (1 - share)[:, None, None]
    positions += track.positions[after] * share[:, None, None]
    positions[(share < 0) | (share > 1) | (gap > MAX_GAP_S)] = np.nan
    confidence = np.minimum(track.confidence[before], track.confidence[after])
    return positions, np.where(np.isfinite(positions[..., 0]), confidence, 0.0)


def velocity(track: Track, device_s: NDArray[np.float64], half_step_s: float = 0.1) -> NDArray[np.float64]:
    """Return the joints' velocity [m/s] in the camera frame, shape (instant_count, 21, 3); 0 where unknown.

    It is a central difference over instants on both sides, so that it is uncorrelated with noise that is symmetric in
    time.
    """
    later, _ = sample(track, device_s + half_step_s)
    earlier, _ = sample(track, device_s - half_step_s)
    return np.nan_to_num((later - earlier) / (2 * half_step_s))


def grid(reference: Track, hz: float = GRID_HZ) -> NDArray[np.float64]:
    """Return common instants on the reference track's clock [s], shape (instant_count,), where it has frames."""
    if len(reference.times_s) < 2:
        return np.zeros(0)
    steps = np.floor(reference.times_s * hz).astype(np.int64)
    near = np.unique(
        np.concatenate([steps, steps + 1])
    )  # a jump of the clock gives a gap instead of a million instants
    return near[near <= reference.times_s[-1] * hz + 1e-6] / hz
