"""Several persons before several Kinects: brings the skeletons of every person into one frame per camera.

The recorder turned and moved each camera's skeletons of a person so that they begin where that person's first camera
saw them. The first camera's own skeletons are therefore as it saw them, for everybody whose first camera it is. Those
of any other camera lie in one frame per person. If such a camera and the first one both see two persons, these frames
can be related: each is fitted to the first camera's skeletons of the same person.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.base.sentences import Said
from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.cameras.first import first_placements
from studio.engine.calibration.estimate import estimate_residuals
from studio.engine.calibration.quality.verdict import GOOD_AGREEMENT_M
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.frames import CameraFrame, ClockModel
from studio.engine.model.joints import to_canonical
from studio.take.importers.kinect_v2 import joint_set

_MAX_TILT_DEG = 5.0
"""Maximum tilt between frames [degrees], because the recorder turned skeletons about the vertical only."""

_BETWEEN_S = 10.0
_SPANS = {"verdict.stopped_agreeing", "verdict.span_disagrees"}
_DOUBTS = {"verdict.little_spread", "verdict.clock_not_found", "verdict.clock_uncertain", *_SPANS}
"""Verdicts with which a calibration is still usable: people recorded together did not walk for a calibration."""


@dataclass(frozen=True)
class PersonStream:
    """One camera's skeletons of one person.

    Attributes:
        times_ns: increasing, shape (frame_count,).
        positions: device joints [m], shape (frame_count, 25, 3); NaN = absent.
        confidence: shape (frame_count, 25).
    """

    times_ns: NDArray[np.int64]
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]

    def frames(self, camera: str) -> list[CameraFrame]:
        """Return the skeletons in canonical joints."""
        return [
            CameraFrame(camera, k, time_ns, *to_canonical(joint_set.JOINT_SET, positions, confidence))
            for k, (time_ns, positions, confidence) in enumerate(
                zip(self.times_ns.tolist(), self.positions, self.confidence, strict=True)
            )
        ]


PersonStreams = dict[str, dict[int, PersonStream]]
"""By camera and person; a person's first camera comes first."""


def in_one_frame(streams: PersonStreams, first: Mapping[int, str], notes: list[str]) -> PersonStreams:
    """Return the skeletons with one frame per camera; those that cannot be brought there are left out and noted.

    Args:
        streams: as recorded.
        first: the camera of each person in whose frame all of that person's skeletons lie.
        notes: of the import; lines are added.
    """
    cameras = [*first.values()]
    reference = max(streams, key=cameras.count)
    own = {person for person, camera in first.items() if camera == reference}
    for person in sorted({*first} - own):
        notes.append(
            f"person {person} was left out: their skeletons lie in the frame of {first[person]}, those of the others "
            f"in that of {reference}, and nothing tells how they lie to each other"
        )
    out: PersonStreams = {reference: {who: one for who, one in streams[reference].items() if who in own}}
    for name, people in streams.items():
        if name != reference:
            theirs = {who: one for who, one in people.items() if who in own and who in out[reference]}
            out[name] = _moved(name, theirs, reference, out[reference], notes)
    return {name: people for name, people in out.items() if people}


def _moved(
    name: str,
    people: dict[int, PersonStream],
    reference: str,
    seen: dict[int, PersonStream],
    notes: list[str],
) -> dict[int, PersonStream]:
    """Return a camera's skeletons in the frame of the person whom both cameras saw most; those of a single person are
    unchanged."""
    if len(people) < 2:
        return people
    placed: dict[int, tuple[NDArray[np.float64], int, float]] = {}
    problems: dict[int, str] = {}
    for person, stream in people.items():
        frames = {reference: seen[person].frames(reference), name: stream.frames(name)}
        _, camera = first_placements(frames, reference, None)
        starts = {camera: mine[0].device_time_ns for camera, mine in frames.items()}
        median_m = estimate_residuals(frames, starts, reference)[name].median_m
        if camera.problem or median_m is None:
            problems[person] = camera.problem or f"{reference} hardly shows them at the same time"
        elif median_m > GOOD_AGREEMENT_M:
            problems[person] = f"{reference} shows them otherwise, {1e3 * median_m:.0f} mm apart"
        else:
            placed[person] = camera.placed.T, camera.pairs or 0, median_m
    anchor = max(placed or people, key=lambda who: placed[who][1] if placed else len(people[who].times_ns))
    out: dict[int, PersonStream] = {anchor: people[anchor]}
    for person, stream in people.items():
        if person in placed:
            notes.append(
                f"{name}: person {person} is {1e3 * placed[person][2]:.0f} mm (median) from {reference}'s"
            )
        if person == anchor:
            continue
        if person not in placed or anchor not in placed:
            why = problems.get(person) or problems[anchor]
            notes.append(f"{name}: person {person} was left out, whose place cannot be told: {why}")
            continue
        move = invert_transform(placed[anchor][0]) @ placed[person][0]
        if (tilt := _degrees(move[1, 1])) > _MAX_TILT_DEG:
            notes.append(
                f"{name}: person {person} was left out: beside person {anchor} they would stand tilted by {tilt:.0f} "
                "degrees"
            )
            continue
        turn = _degrees((np.trace(move[:3, :3]) - 1.0) / 2.0)
        notes.append(
            f"{name}: person {person} was turned by {turn:.1f} degrees and moved by "
            f"{np.linalg.norm(move[:3, 3]):.2f} m into one frame with person {anchor}"
        )
        out[person] = replace(stream, positions=transform_points(move, stream.positions))
    return {person: out[person] for person in people if person in out}


def _degrees(cosine: float) -> float:
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


def calibrated_by_all(streams: PersonStreams, notes: list[str]) -> Calibration | None:
    """Return the calibration by all persons, as if they walked one after the other, without a performer; None if the
    cameras disagree.

    Its cameras are usable at best.

    Args:
        streams: of `in_one_frame`.
        notes: of the import; a line is added.
    """
    every = [one for people in streams.values() for one in people.values()]
    last = max(one.times_ns[-1] for one in every)
    after_ns = int(last - min(one.times_ns[0] for one in every) + _BETWEEN_S * 1e9)
    people = sorted({person for theirs in streams.values() for person in theirs})
    walks = {
        name: [
            replace(frame, device_time_ns=frame.device_time_ns + turn * after_ns)
            for turn, person in enumerate(people)
            if person in theirs
            for frame in theirs[person].frames(name)
        ]
        for name, theirs in streams.items()
    }
    found = calibrate(walks, must_hold="somewhere")
    far = [one.residual_median_mm for one in found.cameras.values()]
    disagree = any(median is None or median > 1e3 * GOOD_AGREEMENT_M for median in far)
    if disagree or any(_is_wrong(one) for one in found.cameras.values()):
        notes.append(
            f"no calibration by these persons: {'; '.join(found.reasons()) or 'cameras do not agree'}"
        )
        return None
    middle_ns = int(min(one.times_ns[0] for one in every)) + after_ns * len(people) // 2
    cameras = {name: _usable(one, middle_ns) for name, one in found.cameras.items()}
    apart = ", ".join(f"{name} {median:.0f}" for name, median in zip(cameras, far, strict=True) if median)
    notes.append(f"the cameras were registered by all persons together (apart by, median: {apart or 0} mm)")
    return replace(found, cameras=cameras, performer=None, floor_given=False)


def _is_wrong(camera: CameraCalibration) -> bool:
    return camera.verdict == "refused" and not {_code(reason) for reason in camera.reasons} <= _DOUBTS


def _code(reason: str) -> str:
    return reason.code if isinstance(reason, Said) else ""


def _usable(camera: CameraCalibration, middle_ns: int) -> CameraCalibration:
    """Return a camera with its clock's offset at the middle and without spans, because the walks were shifted in
    time."""
    reasons = tuple(reason for reason in camera.reasons if _code(reason) not in _SPANS)
    clock = ClockModel(camera.clock.stage_ns(middle_ns) - middle_ns)
    return replace(camera, clock=clock, disagrees=(), verdict="usable", reasons=reasons)
