"""Which edits a take allows: joints that the character has, times in the take, numbers, cameras and performers."""

import math
import re
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from functools import singledispatch
from pathlib import Path

import msgspec
import numpy as np

from studio.engine.base.errors import StudioError, TakeError
from studio.engine.base.sentences import Said, say
from studio.engine.edits.edit import (
    ContactEdit,
    DirectionEdit,
    Edit,
    ExchangeEdit,
    LeaveOutEdit,
    OffsetEdit,
    PinEdit,
    RetimeEdit,
    TrimEdit,
)
from studio.engine.model.joints import CANONICAL, OUTPUT_JOINTS
from studio.take.folder.take import PERFORMER, POSES, Take

_ID = re.compile(r"[A-Za-z0-9_.-]{1,40}")
MOST_NOTE = 500
MOST_EASE_S = 10.0
FURTHEST_M = 100.0
SLOWEST = 20.0
APART_M = 0.5
"""Distance less their radii beyond which two pins of one joint at one time contradict each other [m]."""

TOUCHING = tuple(
    f"{side}_{part}" for side in ("left", "right") for part in ("hand", "ankle", "toe", "knee", "hip")
)
"""Joints of a contact."""


def check_edits(take: Take, edits: Sequence[Edit], others: Iterable[Edit] = ()) -> None:
    """Raise TakeError if an edit is not allowed for a take, or a pin contradicts another one.

    Args:
        take: whose edits.
        edits: to check.
        others: of the take; those with the id of one of `edits` do not count.
    """
    if not edits:
        return
    cameras, performers = _cameras(take), take.all_performers() or [PERFORMER]
    others = [*others]
    cut = any(isinstance(one, TrimEdit | RetimeEdit) for one in (*edits, *others))
    span = None if cut else solved_span(take)  # solves with these edits do not show the take's length
    for one in edits:
        wrong = next(
            filter(None, (*_common(one, performers, span), *_own(one), *_of_camera(one, cameras))), None
        )
        if wrong is not None:
            raise TakeError("edits.not_allowed", "edit {id}: {why}", id=one.id, why=wrong)
    new = {one.id for one in edits}
    every = [*edits, *(one for one in others if one.id not in new)]
    for k, one in enumerate(edits):
        for other in every[k + 1 :]:
            _check_agree(one, other)


def solved_span(take: Take) -> tuple[float, float] | None:
    """Return the first and last time of poses in a take's solves, stage time [s]; None if unknown."""
    spans = [span for file in (take.path / "solves").glob(f"**/{POSES}") if (span := _times(file))]
    return (min(begin for begin, _ in spans), max(end for _, end in spans)) if spans else None


def _times(poses: Path) -> tuple[float, float] | None:
    try:
        with np.load(poses, allow_pickle=False) as file:
            times = file["time_s"]
        return float(times[0]), float(times[-1])
    except (OSError, ValueError, KeyError, IndexError, zipfile.BadZipFile):
        return None


def _cameras(take: Take) -> set[str]:
    try:
        return {*take.camera_names, *take.calibration().cameras}
    except StudioError:
        return {*take.camera_names}


def _common(one: Edit, performers: Sequence[str], span: tuple[float, float] | None) -> Iterator[Said | None]:
    """Yield the errors in the fields that all edits have."""
    if not _ID.fullmatch(one.id):
        yield say("edits.id", "its id is not allowed; allowed: up to 40 letters, digits and . _ -")
    for name, values in _numbers(one):
        if not all(math.isfinite(value) for value in values):
            yield say("edits.number", "{name} is no number", name=name)
    if one.end_s < one.start_s:
        yield say(
            "edits.times", "it ends at {end_s:.2f} s, before it begins at {start_s:.2f} s",
            start_s=one.start_s, end_s=one.end_s,
        )  # fmt: skip
    if not 0.0 <= one.ease_s <= MOST_EASE_S:
        yield _range("ease_s", one.ease_s, 0.0, MOST_EASE_S)
    if span is not None and (one.end_s < span[0] or one.start_s > span[1]):
        yield say(
            "edits.outside_solves",
            "{start_s:.2f} s to {end_s:.2f} s is outside the take, which is solved from {first_s:.2f} s to "
            "{last_s:.2f} s",
            start_s=one.start_s, end_s=one.end_s, first_s=span[0], last_s=span[1],
        )  # fmt: skip
    if one.performer not in performers:
        yield _one_of("performer", one.performer, performers)
    if isinstance(one, ContactEdit) and one.other is not None and one.other not in performers:
        yield _one_of("other", one.other, performers)
    if len(one.note) > MOST_NOTE:
        yield _range("note", len(one.note), 0, MOST_NOTE)


def _numbers(one: Edit) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Yield every field of numbers."""
    for name, value in msgspec.structs.asdict(one).items():
        values = value if isinstance(value, tuple) else (value,)
        if not isinstance(value, bool) and values and all(isinstance(each, int | float) for each in values):
            yield name, values


@singledispatch
def _own(one: Edit) -> Iterator[Said | None]:
    """Yield the errors in the fields that only edits of this kind have."""
    yield from ()


@_own.register
def _(one: PinEdit) -> Iterator[Said | None]:
    yield _joint(one.joint, CANONICAL)
    yield _within("radius_m", (one.radius_m,), 0.0, FURTHEST_M)
    yield _within("place_m", one.place_m, -FURTHEST_M, FURTHEST_M)


@_own.register
def _(one: DirectionEdit) -> Iterator[Said | None]:
    if not any(one.direction):
        yield say("edits.direction", "its direction has no length")
    yield _within("radius_deg", (one.radius_deg,), 0.0, 180.0)


@_own.register
def _(one: ContactEdit) -> Iterator[Said | None]:
    yield _joint(one.joint, TOUCHING)
    if one.touches not in ("floor", "nothing"):
        yield _joint(one.touches, CANONICAL)
    if one.touches == one.joint and one.other in (None, one.performer):
        yield say("edits.itself", "{joint} cannot touch itself", joint=one.joint)


def _doubt(one: LeaveOutEdit | ExchangeEdit) -> Iterator[Said | None]:
    for joint in one.joints:
        yield _joint(joint, CANONICAL)
    if isinstance(one, LeaveOutEdit) and one.camera is None and not one.joints:
        yield say("edits.everything", "it leaves everything out; name a camera or joints")


_own.register(LeaveOutEdit)(_doubt)
_own.register(ExchangeEdit)(_doubt)


@_own.register
def _(one: OffsetEdit) -> Iterator[Said | None]:
    yield _joint(one.joint, OUTPUT_JOINTS)
    yield _within("rotation_deg", one.rotation_deg, -360.0, 360.0)
    yield _within("move_m", one.move_m, -FURTHEST_M, FURTHEST_M)
    if any(one.move_m) and one.joint != "Hips":
        yield say("edits.move", "only Hips can be moved, not {joint}", joint=one.joint)


@_own.register
def _(one: RetimeEdit) -> Iterator[Said | None]:
    yield _within("factor", (one.factor,), 1.0 / SLOWEST, SLOWEST)


def _of_camera(one: Edit, cameras: set[str]) -> Iterator[Said | None]:
    if isinstance(one, LeaveOutEdit | ExchangeEdit) and one.camera is not None and one.camera not in cameras:
        yield _one_of("camera", one.camera, sorted(cameras))


def _joint(name: str, allowed: Sequence[str]) -> Said | None:
    return None if name in allowed else _one_of("joint", name, allowed)


def _one_of(name: str, value: str, allowed: Sequence[str]) -> Said:
    return say(
        "edits.one_of", "{name} {value!r} is not known; allowed: {allowed}",
        name=name, value=value[:80], allowed=[*allowed] or "none",
    )  # fmt: skip


def _within(name: str, values: Sequence[float], low: float, high: float) -> Said | None:
    bad = [value for value in values if math.isfinite(value) and not low <= value <= high]
    return _range(name, bad[0], low, high) if bad else None


def _range(name: str, value: float, low: float, high: float) -> Said:
    return say(
        "edits.range", "{name} {value} is not allowed; allowed: {low} to {high}",
        name=name, value=value, low=low, high=high,
    )  # fmt: skip


def _check_agree(one: Edit, other: Edit) -> None:
    """Raise TakeError if two pins that are on contradict each other."""
    if not (isinstance(one, PinEdit) and isinstance(other, PinEdit) and one.on and other.on):
        return
    if (one.performer, one.joint) != (other.performer, other.joint):
        return
    if one.end_s < other.start_s or other.end_s < one.start_s:
        return
    apart_m = math.dist(one.place_m, other.place_m)
    if apart_m - one.radius_m - other.radius_m > APART_M:
        raise TakeError(
            "edits.two_places",
            "edits {one} and {other} hold {joint} at one time in two places, {apart_m:.2f} m apart; change or "
            "remove one of them",
            one=one.id,
            other=other.id,
            joint=one.joint,
            apart_m=apart_m,
        )
