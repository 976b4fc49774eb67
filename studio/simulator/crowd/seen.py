"""Frames of cameras that see several performers, with mutual occlusion and the devices' body numbers.

A device numbers the bodies that it sees. It loses a body that is mostly hidden, and gives it a new number when it
finds it again. While two bodies overlap in the picture, it may exchange their numbers.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.simulator.clock import SimulatedClock, random_clock
from studio.simulator.crowd.meeting import Meeting
from studio.simulator.instants import instants
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND, NoisyJoints, anatomical_offsets
from studio.simulator.joints.occlusion import hidden_by
from studio.simulator.rig import RigCamera

LOST_SHARE = 0.6
"""Share of hidden joints above which a device loses a body."""

_LOST_FRAMES = 6
"""Minimum number of frames before a device finds a body again."""

_OVERLAP_RAD = 0.12
_EXCHANGES_PER_S = 0.3
"""Rate at which a device exchanges the numbers of two overlapping bodies."""


@dataclass(frozen=True)
class CrowdBody:
    """One body in a camera's frame: performer, device number, joints in the camera frame [m], confidence."""

    who: int
    number: int
    positions_m: NDArray[np.float64]
    confidence: NDArray[np.float64]


@dataclass(frozen=True)
class SeenCrowd:
    """All frames of one camera: name, true capture times [s], times on its own clock [ns], bodies in each frame."""

    camera: str
    taken_s: NDArray[np.float64]
    device_time_ns: NDArray[np.int64]
    bodies: list[list[CrowdBody]]


def see_crowd(meeting: Meeting, rig: tuple[RigCamera, ...], *, seed: int) -> Iterator[SeenCrowd]:
    """Yield each camera's frames with the noise of `noisy_joints`; the same seed gives the same frames.

    Args:
        meeting: the performers.
        rig: the cameras; the first one's clock is the stage clock.
        seed: of all noise, clocks and numbers.
    """
    performers, *streams = np.random.SeedSequence(seed).spawn(1 + len(rig))
    drawn = np.random.default_rng(performers)
    anatomies = [anatomical_offsets(drawn) for _ in meeting.motions]
    for k, (camera, stream) in enumerate(zip(rig, streams, strict=True)):
        rng = np.random.default_rng(stream)
        clock = random_clock(rng)
        clock = SimulatedClock() if k == 0 else clock
        taken = instants(rng, meeting.motions[0].duration_s, FRAMES_PER_SECOND)
        joints = np.array([[motion.at(float(t)) for t in taken] for motion in meeting.motions])
        eye = camera.T_stage_camera[:3, 3]
        there = np.array([taken >= enters_s for enters_s in meeting.enters_s])
        hidden = hidden_of(joints, there, eye)
        seen = [
            NoisyJoints(camera.T_stage_camera, motion.offsets_m, anatomy, rng).see_all(mine, behind)
            for motion, anatomy, mine, behind in zip(meeting.motions, anatomies, joints, hidden, strict=True)
        ]
        found = there & (hidden.mean(axis=2) <= LOST_SHARE)
        numbers = _numbers(found, overlaps_of(joints, eye), rng)
        bodies = [
            [
                CrowdBody(who, int(numbers[who, f]), positions[f], confidence[f])
                for who, (positions, confidence) in enumerate(seen)
                if numbers[who, f] >= 0
            ]
            for f in range(len(taken))
        ]
        stamps = np.round(clock.device_s(taken) * 1e9).astype(np.int64)
        yield SeenCrowd(camera.name, taken, stamps, bodies)


def hidden_of(
    joints: NDArray[np.float64], there: NDArray[np.bool_], eye: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which joints another performer hides, shape (performer_count, F, 21)."""
    out = np.zeros(joints.shape[:3], dtype=bool)
    for who in range(len(joints)):
        for other in range(len(joints)):
            if other != who:
                out[who] |= hidden_by(joints[who], joints[other], eye) & there[other][:, None]
    return out


def overlaps_of(joints: NDArray[np.float64], eye: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which pairs of bodies overlap in the picture, shape (performer_count, performer_count, F)."""
    way = joints.mean(axis=2) - eye
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    return np.einsum("afk,bfk->abf", way, way) > np.cos(_OVERLAP_RAD)


class DeviceNumbers:
    """The numbers that a device gives to bodies, frame by frame."""

    def __init__(self, count: int, rng: np.random.Generator) -> None:
        """Start with none of the `count` performers seen."""
        self._rng, self._used = rng, 0
        self._number, self._lost = np.full(count, -1), np.full(count, _LOST_FRAMES)

    def of(self, found: NDArray[np.bool_], overlaps: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return the number of each body in the next frame, -1 = not seen, shape (performer_count,).

        Args:
            found: seen performers, shape (performer_count,).
            overlaps: pairs that overlap in the picture, shape (performer_count, performer_count).
        """
        number, lost, count = self._number, self._lost, len(found)
        for who in range(count):
            lost[who] = 0 if found[who] and number[who] >= 0 else lost[who] + 1
            if not found[who]:
                number[who] = -1
            elif number[who] < 0 and lost[who] >= _LOST_FRAMES:
                self._used += 1
                number[who], lost[who] = self._used, 0
        for a in range(count):
            for b in range(a):
                draw = self._rng.random() < _EXCHANGES_PER_S / FRAMES_PER_SECOND
                if draw and overlaps[a, b] and number[a] >= 0 and number[b] >= 0:
                    number[[a, b]] = number[[b, a]]
        return number.astype(np.int64)


def _numbers(
    found: NDArray[np.bool_], overlaps: NDArray[np.bool_], rng: np.random.Generator
) -> NDArray[np.int64]:
    """Return the device's number of each body, -1 = not seen, shape (performer_count, F)."""
    device = DeviceNumbers(len(found), rng)
    return np.stack([device.of(found[:, f], overlaps[..., f]) for f in range(found.shape[1])], axis=1)
