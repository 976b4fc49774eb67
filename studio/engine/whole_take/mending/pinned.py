"""Pins of one joint, and the cameras' joints around them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import PinEdit
from studio.engine.edits.frames import Frames
from studio.engine.model.calibration import Calibration, Performer
from studio.engine.model.frames import DRAWN
from studio.engine.model.joints import INDEX, MIRROR
from studio.engine.whole_take.mending.around import Around, around, axes_of
from studio.engine.whole_take.mending.interval import limb_of

Array = NDArray[np.float64]

REACH_S = 2.5
"""Furthest from a pin that an error may last [s]."""

BEYOND_M = 0.1
"""Largest distance of a pin out of reach [m]: floor, click, bones and the limb's root are each off by two or three
centimetres."""


@dataclass(frozen=True)
class PinnedJoint:
    """Pins of one joint that are near one another in time, and the cameras' joints around them.

    Attributes:
        pins: of the joint.
        joint: its index.
        seen: the cameras.
        middle: their joints without gaps [m], shape (count, 21, 3).
        flags: instants with a pin that is within reach, shape (count,).
        place_m: its places, lowered to the cameras' joints, shape (count, 3).
        axes: of the body, shape (count, 3, 3).
        origin_m: their origin, shape (count, 3).
        performer: has the lengths of bones; None = unknown.
    """

    pins: Sequence[PinEdit]
    joint: int
    seen: Around
    middle: Array
    flags: NDArray[np.bool_]
    place_m: Array
    axes: Array
    origin_m: Array
    performer: Performer | None

    def unseen(self) -> NDArray[np.bool_]:
        """Return the instants around pins in which no camera sees the joint, shape (count,)."""
        unseen = ~np.logical_or.reduce(np.isfinite(self.seen.tracks[:, :, self.joint, 0]), axis=1)
        out = np.zeros_like(unseen)
        for at in np.flatnonzero(self.flags):
            first, last = _run_about(unseen, int(at))
            out[first:last] = unseen[first:last]
        return out


def pinned(
    frames: Frames, calibration: Calibration, pins: Sequence[PinEdit], lifted_m: float
) -> PinnedJoint | None:
    """Return pins of one joint with the cameras' joints around them; None where these do not show the joint.

    Args:
        frames: by camera, in order of time.
        calibration: cameras, clocks and the performer's proportions.
        pins: of the joint, near one another in time.
        lifted_m: lift of the performer above the cameras' joints by the solve [m].
    """
    begin = min(pin.start_s for pin in pins) - REACH_S
    end = max(pin.end_s for pin in pins) + REACH_S
    joint, performer = INDEX[pins[0].joint], calibration.performer
    limb = limb_of(joint)[-1]
    seen = around(frames, calibration, begin, end, doubted=[*limb, *MIRROR[list(limb)]])
    if seen is None or not np.isfinite(seen.tracks[:, :, joint]).any():
        return None  # a single camera without depth places nothing
    flags, place = np.zeros(len(seen.time_s), dtype=bool), np.zeros((len(seen.time_s), 3))
    for pin in pins:
        rows = seen.rows_of(pin.start_s, pin.end_s)
        flags[rows], place[rows] = True, np.array(pin.place_m) - [0.0, 0.0, lifted_m]
    middle = seen.middle()
    axes, origin = axes_of(middle, joint)
    if performer is not None:
        out = place - origin
        reach_m = performer.reach_m()[joint]
        far = np.linalg.norm(out, axis=1) / reach_m
        place = origin + out / np.maximum(far, 1.0)[:, None]
        flags &= far < max(DRAWN, 1.0 + BEYOND_M / reach_m)  # one further away proves nothing about cameras
    if not flags.any():
        return None
    return PinnedJoint(pins, joint, seen, middle, flags, place, axes, origin, performer)


def _run_about(flags: NDArray[np.bool_], at: int) -> tuple[int, int]:
    """The first, and one past the last, of the true flags around a place."""
    first = last = at
    while first > 0 and flags[first - 1]:
        first -= 1
    while last < len(flags) and flags[last]:
        last += 1
    return first, last
