"""When edits hold: their share over time, eased in and out."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import Edit

_Kind = TypeVar("_Kind")


def of_kind(edits: Sequence[Edit], kind: type[_Kind]) -> list[_Kind]:
    """Return the edits of a kind."""
    return [edit for edit in edits if isinstance(edit, kind)]


def of_performer(edits: Sequence[Edit], performer: str) -> tuple[Edit, ...]:
    """Return the edits of a performer that are on."""
    return tuple(edit for edit in edits if edit.on and edit.performer == performer)


def share(edit: Edit, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the share of an edit at times [s], 0..1, any shape: 1 from begin to end, eased on both sides."""
    away = np.maximum(np.maximum(edit.start_s - time_s, time_s - edit.end_s), 0.0)
    return eased(1.0 - away / edit.ease_s) if edit.ease_s > 0.0 else (away == 0.0).astype(np.float64)


def holds(edit: Edit, time_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether an edit without easing holds at times [s], any shape; an instant is widened by its `ease_s`."""
    wider = edit.ease_s if edit.start_s == edit.end_s else 0.0
    return (time_s >= edit.start_s - wider) & (time_s <= edit.end_s + wider)


def eased(part: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a smooth step over 0..1: 0 below, 1 above."""
    part = np.clip(part, 0.0, 1.0)
    return part * part * (3.0 - 2.0 * part)
