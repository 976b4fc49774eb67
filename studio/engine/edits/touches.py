"""Contacts from edits, of joints other than feet: with the floor, the own body, or another performer."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import ContactEdit, Edit
from studio.engine.edits.stances import is_of_feet
from studio.engine.edits.timing import of_kind, share
from studio.engine.model.joints import INDEX

SIGMA_M = 0.006
"""Standard deviation of a joint from the place where it touches [m]: flesh gives way."""

LEAST_SHARE = 0.02


@dataclass(frozen=True)
class Touch:
    """A joint that touches the floor or another joint.

    Attributes:
        joint: index of the canonical joint.
        touched: index of the joint that it touches; None = the floor.
        information: inverse variance [1/m2] in frames, shape (frame_count,); 0 = no contact.
    """

    joint: int
    touched: int | None
    information: NDArray[np.float64]


def is_touch(edit: ContactEdit) -> bool:
    """Whether solves hold a contact as a `Touch`."""
    return not is_of_feet(edit) and edit.touches != "nothing" and edit.other in (None, edit.performer)


def is_touch_of_other(edit: ContactEdit) -> bool:
    """Whether a contact is with another performer's joint."""
    own = edit.other in (None, edit.performer)
    return not own and not is_of_feet(edit) and edit.touches not in ("floor", "nothing")


class Touches:
    """The touches of one performer."""

    def __init__(self, edits: Sequence[Edit]) -> None:
        """Take the touches among the edits."""
        every = [edit for edit in of_kind(edits, ContactEdit) if edit.joint in INDEX]
        self._edits = [edit for edit in every if is_touch(edit)]
        self._of_others = [edit for edit in every if is_touch_of_other(edit) and edit.touches in INDEX]

    def __bool__(self) -> bool:
        return bool(self._edits) or bool(self._of_others)

    def at(self, time_s: NDArray[np.float64]) -> list[Touch]:
        """Return the touches of the floor and of the own body in frames at times [s], shape (frame_count,).

        Touches that hold in none of the frames are left out.
        """
        return [found for edit in self._edits if (found := _touch(edit, time_s)) is not None]

    def of_others(self, time_s: NDArray[np.float64]) -> list[tuple[Touch, str]]:
        """Return the touches of other performers' joints in frames, each with the other performer."""
        found = [(_touch(edit, time_s), edit.other) for edit in self._of_others]
        return [(touch, other) for touch, other in found if touch is not None and other is not None]

    def now(self, time_s: float) -> tuple[tuple[int, int | None, float], ...]:
        """Return the touches at one time [s], as `FrameSet.touches` has them."""
        found = self.at(np.array([time_s])) if self._edits else []
        return tuple((one.joint, one.touched, float(one.information[0])) for one in found)


def _touch(edit: ContactEdit, time_s: NDArray[np.float64]) -> Touch | None:
    """A contact in frames at times [s]; None where it holds in none."""
    told = share(edit, time_s)
    if told.max(initial=0.0) <= LEAST_SHARE:
        return None
    touched = None if edit.touches == "floor" else INDEX[edit.touches]
    information = np.where(told > LEAST_SHARE, told**4, 0.0) / SIGMA_M**2
    return Touch(INDEX[edit.joint], touched, information)
