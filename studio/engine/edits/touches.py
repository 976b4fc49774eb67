"""Contacts that edits say, of other joints than feet: a joint on the floor, or on another joint of the own body."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import ContactEdit, Edit
from studio.engine.edits.stances import is_of_feet
from studio.engine.edits.timing import of_kind, share
from studio.engine.model.joints import INDEX

SIGMA_M = 0.006
"""Standard deviation of a joint from where it touches [m]: flesh gives way."""

LEAST_SHARE = 0.02


@dataclass(frozen=True)
class Touch:
    """A joint that touches.

    Attributes:
        joint: index of the canonical joint.
        touched: index of the joint that it touches; None = the floor.
        information: inverse variance [1/m2] in frames, shape (frame_count,); 0 = it does not.
    """

    joint: int
    touched: int | None
    information: NDArray[np.float64]


def is_touch(edit: ContactEdit) -> bool:
    """Whether a contact is one that solves hold as a `Touch`."""
    return not is_of_feet(edit) and edit.touches != "nothing" and edit.other in (None, edit.performer)


class Touches:
    """The touches of one performer."""

    def __init__(self, edits: Sequence[Edit]) -> None:
        """Take those among the edits."""
        self._edits = [edit for edit in of_kind(edits, ContactEdit) if is_touch(edit) and edit.joint in INDEX]

    def __bool__(self) -> bool:
        return bool(self._edits)

    def at(self, time_s: NDArray[np.float64]) -> list[Touch]:
        """Return the touches in frames at times [s], shape (frame_count,); those that hold in none are left out."""
        out = []
        for edit in self._edits:
            told = share(edit, time_s)
            if told.max(initial=0.0) > LEAST_SHARE:
                touched = None if edit.touches == "floor" else INDEX[edit.touches]
                information = np.where(told > LEAST_SHARE, told**4, 0.0) / SIGMA_M**2
                out.append(Touch(INDEX[edit.joint], touched, information))
        return out

    def now(self, time_s: float) -> tuple[tuple[int, int | None, float], ...]:
        """Return the touches at one time [s], as `FrameSet.touches` has them."""
        found = self.at(np.array([time_s])) if self._edits else []
        return tuple((one.joint, one.touched, float(one.information[0])) for one in found)
