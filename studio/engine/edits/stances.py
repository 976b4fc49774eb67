"""Stances of feet from edits: which feet stand on the floor, or do not, at any time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import ContactEdit, Edit
from studio.engine.edits.timing import holds, of_kind

FEET = ("left_ankle", "left_toe", "right_ankle", "right_toe")
"""Joints that stand, in the order of the columns of stances."""

STANDS, AS_FOUND, FREE = 1, 0, -1


def is_of_feet(edit: ContactEdit) -> bool:
    """Whether a contact is of a foot, with the floor or with nothing."""
    return edit.joint in FEET and edit.touches in ("floor", "nothing")


class Stances:
    """Stances of feet from edits; an ankle stands for the whole foot."""

    def __init__(self, edits: Sequence[Edit]) -> None:
        """Take the feet's contacts among the edits."""
        self._edits = [edit for edit in of_kind(edits, ContactEdit) if is_of_feet(edit)]

    def __bool__(self) -> bool:
        return bool(self._edits)

    def at(self, time_s: NDArray[np.float64]) -> NDArray[np.int8]:
        """Return `STANDS`, `AS_FOUND` or `FREE` at times [s], shape (time_count, 4); the last edit counts."""
        out = np.full((len(time_s), len(FEET)), AS_FOUND, dtype=np.int8)
        for edit in self._edits:
            inside = holds(edit, time_s)
            for column in _columns(edit):
                out[inside, column] = STANDS if edit.touches == "floor" else FREE
        return out

    def asked(
        self, time_s: NDArray[np.float64], hold: NDArray[np.float64], pieces: Sequence[tuple[int, int]]
    ) -> NDArray[np.int8]:
        """Return the same for frames with found stances; an instant without contact removes the whole stance.

        Args:
            time_s: of the frames [s], shape (frame_count,).
            hold: found stances, 0 = free, shape (frame_count, 4).
            pieces: begin and end of each part of the take without a gap.
        """
        out = np.full((len(time_s), len(FEET)), AS_FOUND, dtype=np.int8)
        for edit in self._edits:
            inside, columns = holds(edit, time_s), _columns(edit)
            for column in columns:
                rows = inside
                if edit.touches == "nothing" and edit.start_s == edit.end_s:
                    rows = _whole(inside, hold[:, column] > 0.0, pieces)
                out[rows, column] = STANDS if edit.touches == "floor" else FREE
        return out


def _columns(edit: ContactEdit) -> list[int]:
    first = FEET.index(edit.joint)
    return [first, first + 1] if edit.joint.endswith("_ankle") else [first]


def _whole(
    inside: NDArray[np.bool_], stands: NDArray[np.bool_], pieces: Sequence[tuple[int, int]]
) -> NDArray[np.bool_]:
    """Some frames, with the whole stances that contain them."""
    out = inside.copy()
    for begin, end in pieces:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], stands[begin:end], [False]])))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            if inside[begin + first : begin + last].any():
                out[begin + first : begin + last] = True
    return out
