"""Pins as input of solves: places of joints that are always right, with their information at any time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import ContactEdit, Edit, PinEdit
from studio.engine.edits.stances import Stances
from studio.engine.edits.timing import of_kind, share
from studio.engine.edits.touches import Touches
from studio.engine.model.calibration import Performer
from studio.engine.model.frames import Pinned
from studio.engine.model.joints import INDEX, JOINT_COUNT

SIGMA_M = 0.005
"""Standard deviation of a joint from the place of its pin [m]."""

LEAST_SHARE = 0.02
"""Share below which an edit that eases out is over."""


class Pins:
    """The pins of one performer.

    Attributes:
        stances: stances of their feet.
        touches: contacts of other joints.
        spans_s: begin and end of all pins, stances and contacts [s].
    """

    def __init__(self, edits: Sequence[Edit], performer: Performer | None = None) -> None:
        """Take the pins and stances among edits; pins of unknown joints are left out.

        Args:
            edits: of one performer.
            performer: their proportions, which give the reach of limbs; None = unlimited reach.
        """
        self._reach_m = np.full(JOINT_COUNT, np.inf) if performer is None else performer.reach_m()
        self.stances, self.touches = Stances(edits), Touches(edits)
        self._pins = [pin for pin in of_kind(edits, PinEdit) if pin.joint in INDEX]
        self._spans = [
            (pin.start_s, pin.end_s) if pin.start_s == pin.end_s else _with_ease(pin) for pin in self._pins
        ]
        self.spans_s = [*self._spans, *(_with_ease(edit) for edit in of_kind(edits, ContactEdit))]

    def __bool__(self) -> bool:
        return bool(self._pins) or bool(self.stances) or bool(self.touches)

    def at(self, time_s: NDArray[np.float64], dt: float) -> Pinned:
        """Return the pinned joints in frames.

        A pin of one instant counts in the nearest frame. A joint with several pins has their weighted mean.

        Args:
            time_s: of the frames [s], shape (frame_count,).
            dt: time between two frames [s].
        """
        shape = (len(time_s), JOINT_COUNT)
        place, radius, information = np.zeros((*shape, 3)), np.zeros(shape), np.zeros(shape)
        for pin in self._pins:
            told = _told(pin, time_s, dt) / SIGMA_M**2
            joint = INDEX[pin.joint]
            place[:, joint] += told[:, None] * np.array(pin.place_m)
            radius[:, joint] += told * pin.radius_m
            information[:, joint] += told
        known = np.maximum(information, 1e-12)
        return Pinned(place / known[..., None], radius / known, information, self._reach_m)

    def between(self, begin_s: float, end_s: float) -> Pinned | None:
        """Return the pinned joints after `begin_s` up to `end_s` [s], without an axis of frames; None = none."""
        if not any(first <= end_s and last > begin_s for first, last in self._spans):
            return None
        middle = 0.5 * (begin_s + end_s)
        found = self.at(np.array([middle]), end_s - begin_s)
        return Pinned(found.place_m[0], found.radius_m[0], found.information[0], self._reach_m)


def _with_ease(edit: Edit) -> tuple[float, float]:
    return edit.start_s - edit.ease_s, edit.end_s + edit.ease_s


def _told(pin: PinEdit, time_s: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    """Weight of a pin in frames, 0..1, shape (frame_count,)."""
    if pin.start_s == pin.end_s:
        away = time_s - pin.start_s
        return ((away >= -0.5 * dt) & (away < 0.5 * dt)).astype(np.float64)
    told = share(pin, time_s)
    return np.where(told > LEAST_SHARE, told**4, 0.0)
