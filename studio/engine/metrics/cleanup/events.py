"""Clean-up events: errors that an animator would correct, each with its time, joint and size."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.arrays import runs
from studio.engine.metrics.results import CleanupEventJson
from studio.engine.model.joints import CANONICAL

KINDS: tuple[str, ...] = (
    "joint_pop",
    "limb_flip",
    "stance_slide",
    "floor_penetration",
    "self_penetration",
    "frozen_limb",
)

JOIN_S = 0.2
"""Gap below which two events of one kind and place are merged, because they are corrected together."""


@dataclass(frozen=True)
class CleanupEvent:
    """One error to correct.

    Attributes:
        kind: one of `KINDS`.
        joint: canonical joint with the largest error.
        start_s, end_s: stage time [s].
        peak_s: stage time of the largest error [s].
        size: largest error, in `unit`.
        unit: "cm", "deg" or "s".
        detail: further information, such as the other body part; may be empty.
    """

    kind: str
    joint: str
    start_s: float
    end_s: float
    peak_s: float
    size: float
    unit: str
    detail: str = ""

    def to_json(self) -> CleanupEventJson:
        return {
            "kind": self.kind,
            "joint": self.joint,
            "start_s": round(self.start_s, 4),
            "end_s": round(self.end_s, 4),
            "peak_s": round(self.peak_s, 4),
            "size": round(self.size, 3),
            "unit": self.unit,
            "detail": self.detail,
        }


def limb_of(joint: str) -> str:
    """Return the part of the body that is corrected as one: `trunk`, `left_arm`, `left_leg`, ..."""
    side, _, name = joint.partition("_")
    if not name:
        return "trunk"
    return f"{side}_{'arm' if name in ('shoulder', 'elbow', 'wrist', 'hand') else 'leg'}"


LIMB_OF: tuple[str, ...] = tuple(limb_of(name) for name in CANONICAL)


def events_of(
    kind: str,
    joint: str,
    time_s: NDArray[np.float64],
    size: NDArray[np.float64],
    flags: NDArray[np.bool_],
    *,
    unit: str,
    least_s: float = 0.0,
    detail: str = "",
) -> list[CleanupEvent]:
    """Return an event per run of `flags`, with the largest `size` inside.

    Args:
        size: shape (sample_count,), NaN where unknown; flags: shape (sample_count,).
        least_s: shortest run that counts.
    """
    found = []
    for first, last in runs(flags & np.isfinite(size)):
        if time_s[last - 1] - time_s[first] >= least_s - 1e-9:
            peak = first + int(np.argmax(size[first:last]))
            span = (float(time_s[first]), float(time_s[last - 1]), float(time_s[peak]))
            found.append(CleanupEvent(kind, joint, *span, float(size[peak]), unit, detail))
    return found


def joined(events: Sequence[CleanupEvent], place: Callable[[CleanupEvent], str]) -> list[CleanupEvent]:
    """Return the events by time, with overlapping or close ones of one kind and place merged."""
    out: list[CleanupEvent] = []
    last: dict[tuple[str, str], int] = {}
    for event in sorted(events, key=lambda e: e.start_s):
        key = (event.kind, place(event))
        k = last.get(key)
        if k is not None and event.start_s <= out[k].end_s + JOIN_S:
            out[k] = _together(out[k], event)
        else:
            last[key] = len(out)
            out.append(event)
    return out


def _together(a: CleanupEvent, b: CleanupEvent) -> CleanupEvent:
    """Return the larger event over the time of both; the first if their units differ."""
    larger = b if a.unit == b.unit and b.size > a.size else a
    return replace(larger, start_s=min(a.start_s, b.start_s), end_s=max(a.end_s, b.end_s))
