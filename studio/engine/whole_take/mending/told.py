"""Errors of cameras that pins found, and how they were mended."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import PinEdit
from studio.engine.model.joints import CANONICAL
from studio.engine.model.solve_metrics import MendedJson
from studio.engine.whole_take.mending.around import Around
from studio.engine.whole_take.mending.evidence import Erring


@dataclass(frozen=True)
class PinFinding:
    """An error of cameras that a pin proved.

    Attributes:
        pins: ids of the pins.
        joints: names of the joints that were wrong, the nearest to the trunk first.
        cameras: names of those that were wrong; none = no camera saw the joint.
        start_s, end_s: begin and end, stage time [s].
        exchanges: cameras that exchanged left and right meanwhile, and when [s]; then the other limb was wrong.
        guessed: the joint is unknown there, and was put where it most likely was between the pins.
    """

    pins: tuple[str, ...]
    joints: tuple[str, ...]
    cameras: tuple[str, ...]
    start_s: float
    end_s: float
    exchanges: tuple[tuple[str, float], ...]
    guessed: bool

    def to_json(self) -> MendedJson:
        """Return it as `metrics.json` has it."""
        return {
            "joints": list(self.joints),
            "cameras": list(self.cameras),
            "start_s": round(self.start_s, 3),
            "end_s": round(self.end_s, 3),
            "exchanges": [
                {"camera": camera, "time_s": round(time_s, 3)} for camera, time_s in self.exchanges
            ],
            "guessed": self.guessed,
        }


def told_of(
    seen: Around,
    pins: Sequence[PinEdit],
    at: slice,
    found: Erring,
    errs: NDArray[np.bool_],
    turned: NDArray[np.bool_],
    *,
    fades: bool,
) -> PinFinding:
    """Return the finding of an error.

    Args:
        seen: the cameras.
        pins: of the joint.
        at: instants with a pin.
        found: the error.
        errs: where cameras err, shape (row_count, camera_count).
        turned: where a camera's names are those of the other side, shape (count, camera_count).
        fades: the pin is the only evidence of the error, which is assumed to last half a second around it.
    """
    rows, names = found.rows, list(seen.cameras)
    changes = np.diff(turned[rows], axis=0) & errs[1:] & errs[:-1]
    return PinFinding(
        _ids(seen, pins, at),
        tuple(CANONICAL[joint] for joint in found.joints),
        tuple(names[k] for k in np.flatnonzero(errs.any(axis=0))),
        float(seen.time_s[rows.start]),
        float(seen.time_s[rows.stop - 1]),
        tuple((names[k], float(seen.time_s[rows.start + row + 1])) for row, k in np.argwhere(changes)),
        guessed=fades or not found.follows,
    )


def told_of_unseen(seen: Around, pins: Sequence[PinEdit], joint: int, rows: slice) -> PinFinding:
    """Return the finding of instants around pins at which no camera sees the joint."""
    return PinFinding(
        _ids(seen, pins, rows),
        (CANONICAL[joint],),
        (),
        float(seen.time_s[rows.start]),
        float(seen.time_s[rows.stop - 1]),
        (),
        guessed=True,
    )


def _ids(seen: Around, pins: Sequence[PinEdit], at: slice) -> tuple[str, ...]:
    """The pins that hold at some of these instants."""
    rows = {pin.id: seen.rows_of(pin.start_s, pin.end_s) for pin in pins}
    return tuple(id_ for id_, own in rows.items() if own.start < at.stop and at.start < own.stop)
