"""Outcome of a solve's edits: which it could not honour, and by how much it missed the others."""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.sentences import Said, say
from studio.engine.edits.edit import (
    ContactEdit,
    DirectionEdit,
    Edit,
    ExchangeEdit,
    LeaveOutEdit,
    OffsetEdit,
    PinEdit,
)
from studio.engine.edits.stances import is_of_feet
from studio.engine.edits.timing import of_kind
from studio.engine.edits.touches import is_touch, is_touch_of_other
from studio.engine.model.joints import INDEX, OUTPUT_INDEX, OUTPUT_OF_CANONICAL
from studio.engine.model.poses import Poses
from studio.engine.model.solve_metrics import EditJson

CONTRADICT_M = 0.5
"""Distance from which pins of one joint at one instant contradict each other."""

SAME_S = 0.01
"""Two instants this near count as one."""

NEAR_MM = 30.0
"""A pin is honoured if it is missed by less."""

NEAR_DEG = 10.0
"""A direction is honoured if it is missed by less."""


def refused(
    edits: Sequence[Edit],
    *,
    cameras: Sequence[str],
    performers: Sequence[str],
    span_s: tuple[float, float],
) -> dict[str, Said]:
    """Return why edits cannot be honoured, one line by edit id; all others are left to the solve.

    Args:
        edits: those that are on.
        cameras: names of the take's cameras.
        performers: the performers in the take.
        span_s: begin and end of the take, stage time [s].
    """
    found = {edit.id: line for edit in edits if (line := _refused(edit, cameras, performers, span_s))}
    pins = [pin for pin in of_kind(edits, PinEdit) if pin.id not in found]
    for one, other in combinations(pins, 2):
        apart_m = _apart_m(one, other)
        if apart_m >= CONTRADICT_M:
            for this, that in ((one, other), (other, one)):
                found.setdefault(
                    this.id,
                    say(
                        "evidence.contradict",
                        "contradicts pin {other}, which has {joint} {metres:.2f} m from here at the same time: "
                        "neither is used; switch one off",
                        other=that.id,
                        joint=this.joint,
                        metres=apart_m,
                    ),
                )
    return found


def _apart_m(one: PinEdit, other: PinEdit) -> float:
    """Distance of two pins of one joint at one time, less their radii [m]; 0 for any other two pins."""
    same = one.joint == other.joint and one.performer == other.performer
    if not same or max(one.start_s, other.start_s) > min(one.end_s, other.end_s) + SAME_S:
        return 0.0
    between = float(np.linalg.norm(np.subtract(one.place_m, other.place_m)))
    return max(between - one.radius_m - other.radius_m, 0.0)


def _refused(
    edit: Edit,
    cameras: Sequence[str],
    performers: Sequence[str],
    span_s: tuple[float, float],
) -> Said | None:
    if edit.performer not in performers:
        return say("evidence.no_performer", "the take has no {performer}", performer=edit.performer)
    if edit.end_s < span_s[0] - SAME_S or edit.start_s > span_s[1] + SAME_S:
        return say(
            "evidence.outside",
            "lies outside the take, which goes from {begin:.2f} to {end:.2f} s",
            begin=span_s[0],
            end=span_s[1],
        )
    for joint, known in _joints(edit).items():
        if not known:
            return say("evidence.no_joint", "the character has no joint {joint}", joint=joint)
    if isinstance(edit, LeaveOutEdit | ExchangeEdit) and edit.camera not in (None, *cameras):
        return say(
            "evidence.no_camera",
            "the take has no camera {camera}, only {cameras}",
            camera=edit.camera,
            cameras=[*cameras],
        )
    if isinstance(edit, ContactEdit) and not (is_of_feet(edit) or is_touch(edit) or is_touch_of_other(edit)):
        return say("evidence.not_used", "solves do not use this kind of edit yet")
    return None


def _joints(edit: Edit) -> dict[str, bool]:
    """The joints that an edit names, and whether each exists."""
    if isinstance(edit, PinEdit):
        return {edit.joint: edit.joint in INDEX}
    if isinstance(edit, ContactEdit):
        touched = {} if edit.touches in ("floor", "nothing") else {edit.touches: edit.touches in INDEX}
        return {edit.joint: edit.joint in INDEX, **touched}
    if isinstance(edit, LeaveOutEdit | ExchangeEdit):
        return {joint: joint in INDEX for joint in edit.joints}
    if isinstance(edit, OffsetEdit):
        return {edit.joint: edit.joint in OUTPUT_INDEX}
    return {}


def outcome(edit: Edit, poses: Poses) -> EditJson:
    """Return the outcome of an edit that was not refused."""
    if isinstance(edit, PinEdit):
        missed_mm = 1e3 * missed_m(edit, poses)
        out: EditJson = {"honoured": missed_mm < NEAR_MM, "missed_mm": round(missed_mm, 1)}
        if not out["honoured"]:
            line = say(
                "evidence.missed",
                "{joint} came within {mm:.0f} mm: the body, or the other edits, hold it back",
                joint=edit.joint,
                mm=missed_mm,
            )
            out |= _told(line)
        return out
    return {"honoured": True}


def direction_outcome(edit: DirectionEdit, missed: float) -> EditJson:
    """Return the outcome of a direction that was missed by this angle [degrees]."""
    out: EditJson = {"honoured": missed < NEAR_DEG, "missed_deg": round(missed, 1)}
    if not out["honoured"]:
        line = say(
            "evidence.missed_direction",
            "{of} came within {deg:.0f} degrees: neck and wrist turn no further",
            of=edit.of,
            deg=missed,
        )
        out |= _told(line)
    return out


def touch_outcome(edit: ContactEdit, missed_m: float) -> EditJson:
    """Return the outcome of a contact that was missed by this distance."""
    out: EditJson = {"honoured": 1e3 * missed_m < NEAR_MM, "missed_mm": round(1e3 * missed_m, 1)}
    if not out["honoured"]:
        out |= _told(_missed_touch(edit, 1e3 * missed_m))
    return out


def _missed_touch(edit: ContactEdit, missed_mm: float) -> Said:
    if is_touch_of_other(edit):
        return say(
            "evidence.missed_other",
            "{joint} came within {mm:.0f} mm of {touched} of {other}: the bodies, or the other edits, hold them "
            "back; only preset finish holds contacts with another performer",
            joint=edit.joint,
            mm=missed_mm,
            touched=edit.touches,
            other=edit.other or "",
        )
    return say(
        "evidence.missed_touch",
        "{joint} came within {mm:.0f} mm of {touched}: the body, or the other edits, hold it back; only presets "
        "studio and finish hold contacts",
        joint=edit.joint,
        mm=missed_mm,
        touched=edit.touches,
    )


def missed_m(pin: PinEdit, poses: Poses) -> float:
    """Return the largest distance of a pin's joint from its place, beyond its radius, while the pin holds [m]."""
    joint = poses.joint_names.index(OUTPUT_OF_CANONICAL[pin.joint])
    inside = poses.time_s[(poses.time_s >= pin.start_s) & (poses.time_s <= pin.end_s)]
    if pin.start_s == pin.end_s or not len(inside):
        inside = np.array([poses.time_s[np.abs(poses.time_s - pin.start_s).argmin()]])
    rows = np.searchsorted(poses.time_s, inside)
    away: NDArray[np.float64] = np.linalg.norm(poses.positions_m[rows, joint] - pin.place_m, axis=1)
    return float(np.maximum(away - pin.radius_m, 0.0).max())


def not_honoured(line: Said) -> EditJson:
    """Return the outcome of an edit that was refused."""
    return {"honoured": False, **_told(line)}


def _told(line: Said) -> EditJson:
    return {"line": str(line), "said": [line.to_json()]}


def outcomes(
    edits: Sequence[Edit], lines: Mapping[str, Said], poses: Mapping[str, Poses]
) -> dict[str, EditJson]:
    """Return the outcome of each edit, by its id.

    Args:
        edits: those that are on.
        lines: from `refused`.
        poses: of each performer.
    """
    return {
        edit.id: not_honoured(lines[edit.id]) if edit.id in lines else outcome(edit, poses[edit.performer])
        for edit in edits
    }
