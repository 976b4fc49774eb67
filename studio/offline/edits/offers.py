"""What to mend, in order: the clean-up events of a solve, what caused each, and the edit that would mend it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.sentences import Said, say
from studio.engine.edits.edit import ContactEdit, Edit, LeaveOutEdit, PinEdit
from studio.engine.metrics.cleanup.events import limb_of
from studio.engine.metrics.cleanup.solve import solve_cleanup
from studio.engine.metrics.results import CleanupEventJson
from studio.engine.model.joints import CANONICAL, INDEX, MIRROR, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.poses import Poses
from studio.engine.whole_take.trace import Trace

Array = NDArray[np.float64]

ABOUT_S = 0.1
"""Time before and after an event in which its cause is searched [s]."""

COURSE_S, LEFT_OUT_S = 0.15, 0.04
"""A joint's course is a cubic fitted to its places within the first time of the peak [s], without those within the
second [s]."""

CAUSE_M = 0.08
"""A camera caused an event if its joint is off the course by more than this [m]."""

BEYOND_S = 0.25
"""Extension of an event on either side [s], because a camera's error often lasts longer than the event."""

FEET = ("left_ankle", "left_toe", "right_ankle", "right_toe")


@dataclass(frozen=True)
class Offer:
    """A clean-up event, its cause, and what would mend it.

    Attributes:
        event: as in the figures of a solve.
        camera: the one whose joint is furthest from the body's course; None = none.
        joint: the canonical joint.
        off_mm: how far it is off [mm].
        why: the cause, one line.
        edits: each would mend it, the likeliest first; empty = none is known.
    """

    event: CleanupEventJson
    camera: str | None
    joint: str
    off_mm: float
    why: Said
    edits: tuple[Edit, ...]


def offers(
    poses: Poses, trace: Trace, *, start_s: float | None = None, performer: str = "performer_1"
) -> list[Offer]:
    """Return the clean-up events of a solve by time, each with its cause and an edit.

    Args:
        poses: the solve.
        trace: its inputs, with as many frames.
        start_s: stage time before which nothing counts [s].
        performer: whose it is.
    """
    events = solve_cleanup(poses, start_s=start_s)["cleanup_events"] or []
    return [_offer(event, k, poses, trace, performer) for k, event in enumerate(events)]


def _offer(event: CleanupEventJson, number: int, poses: Poses, trace: Trace, performer: str) -> Offer:
    joint = INDEX[event["joint"]]
    camera, off_m = _cause(event, joint, poses, trace)
    name = trace.cameras[camera] if camera is not None else None
    called = event["joint"].replace("_", " ")
    if name is None:
        why = say("offers.solve", "no camera is far off: the solve itself moves the {joint}", joint=called)
    else:
        why = say(
            "offers.camera",
            "{camera} has the {joint} {mm:.0f} mm off its course",
            camera=name,
            joint=called,
            mm=1e3 * off_m,
        )
    edits = _edits(event, name, poses, f"offer_{number}", performer)
    return Offer(event, name, event["joint"], round(1e3 * off_m, 1), why, tuple(edits))


def _edits(
    event: CleanupEventJson, camera: str | None, poses: Poses, id_: str, performer: str
) -> Iterator[Edit]:
    """Alternative edits that would mend an event, the likeliest first."""
    joint, note = event["joint"], "offered"
    begin, end = event["start_s"] - 0.5 * ABOUT_S, event["end_s"] + 0.5 * ABOUT_S
    limb = tuple(name for name in CANONICAL if limb_of(name) == limb_of(joint))
    if event["kind"] in ("stance_slide", "floor_penetration") and joint in FEET:
        for one in dict.fromkeys((joint, f"{joint.split('_')[0]}_ankle")):
            yield ContactEdit(id=id_, joint=one, start_s=begin, end_s=end, performer=performer, note=note)
    if camera is not None:
        yield LeaveOutEdit(
            id=id_, camera=camera, joints=limb, start_s=begin, end_s=end, performer=performer, note=note
        )
    if event["kind"] == "joint_pop":
        at = int(np.abs(poses.time_s - event["peak_s"]).argmin())
        place = _course(poses, INDEX[joint], at)
        if place is not None:
            x, y, z = place.tolist()
            at_s = float(poses.time_s[at])
            yield PinEdit(
                id=id_,
                joint=joint,
                place_m=(x, y, z),
                start_s=at_s,
                end_s=at_s,
                performer=performer,
                note=note,
            )
    if joint in FEET or joint.endswith("_knee"):
        foot = f"{joint.split('_')[0]}_ankle"
        yield ContactEdit(
            id=id_, joint=foot, touches="nothing", start_s=begin, end_s=end, performer=performer, note=note
        )
    yield LeaveOutEdit(id=id_, joints=(joint,), start_s=begin, end_s=end, performer=performer, note=note)
    if camera is not None:
        yield LeaveOutEdit(
            id=id_,
            camera=camera,
            joints=limb,
            start_s=begin - BEYOND_S,
            end_s=end + BEYOND_S,
            performer=performer,
            note=note,
        )


def _course(poses: Poses, joint: int, at: int) -> Array | None:
    """Place of a joint on its course around a frame [m], shape (3,); None with too few places."""
    away = poses.time_s - poses.time_s[at]
    rows = np.flatnonzero((np.abs(away) <= COURSE_S) & (np.abs(away) > LEFT_OUT_S))
    if len(rows) < 6 or away[rows].min() > 0.0 or away[rows].max() < 0.0:
        return None
    powers = away[rows, None] ** np.arange(4)
    return np.linalg.lstsq(powers, poses.positions_m[rows, OUTPUT_OF_CANONICAL_INDEX[joint]], rcond=None)[0][
        0
    ]


def _cause(event: CleanupEventJson, joint: int, poses: Poses, trace: Trace) -> tuple[int | None, float]:
    """The camera whose used joint is furthest from the body's course around an event, and how far [m]."""
    rows = np.flatnonzero(
        (poses.time_s >= event["start_s"] - ABOUT_S) & (poses.time_s <= event["end_s"] + ABOUT_S)
    )
    best: tuple[int | None, float] = (None, 0.0)
    for row in rows.tolist():
        course = _course(poses, joint, row)
        if course is None:
            continue
        frames, fused = trace.inputs(row)
        either = np.stack([frames.positions[:, joint], frames.positions[:, MIRROR[joint]]])
        away = np.linalg.norm(either - course, axis=2).min(axis=0)
        away = np.where(fused.used[:, joint], away, np.nan)
        if np.isfinite(away).any() and np.nanmax(away) > best[1]:
            best = int(np.nanargmax(away)), float(np.nanmax(away))
    return best if best[1] > CAUSE_M else (None, best[1])
