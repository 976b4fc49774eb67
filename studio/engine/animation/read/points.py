"""Labelled points over time, as marker files hold them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError

LARGEST_M = 1e4
"""A larger coordinate is no place on a stage [m]."""


@dataclass(frozen=True)
class NamedPoints:
    """Points of a marker file.

    Attributes:
        time_s: the first frame is at 0 [s], shape (frame_count,), increasing.
        names: labels without the name of the subject, shape (point_count,).
        positions_m: z up, right-handed, shape (frame_count, point_count, 3); NaN = a gap.
        notes: what was left out or chosen, one line each.
    """

    time_s: NDArray[np.float64]
    names: tuple[str, ...]
    positions_m: NDArray[np.float64]
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.positions_m.shape != (len(self.time_s), len(self.names), 3):
            raise FormatError(
                "points.shape",
                "points need positions of shape {wanted}; got {shape}",
                wanted=(len(self.time_s), len(self.names), 3),
                shape=self.positions_m.shape,
            )
        if len(self.time_s) == 0 or not np.isfinite(self.positions_m).all(axis=2).any():
            raise FormatError(
                "points.none", "points: no point is seen in any frame; give a recording with points"
            )
        if np.nanmax(np.abs(self.positions_m)) > LARGEST_M:
            raise FormatError(
                "points.far",
                "points: a coordinate is over {m:g} m; is the unit of the file right?",
                m=LARGEST_M,
            )
        if not (np.isfinite(self.time_s).all() and (np.diff(self.time_s) > 0).all()):
            raise FormatError(
                "points.times", "points: the times must be finite and increase from frame to frame"
            )


def without_subject(labels: list[str]) -> tuple[tuple[str, ...], list[int], list[str]]:
    """Return labels without their subject, the kept ones, and notes.

    `Anna:LKNE` is point LKNE of the subject Anna. Of several subjects the one with most points is kept, and of
    duplicate labels the first.
    """
    subjects = [label.rsplit(":", 1)[0].strip() if ":" in label else "" for label in labels]
    named = [subject for subject in subjects if subject]
    notes, wanted = [], ""
    if len(set(named)) > 1:
        wanted = max(sorted(set(named)), key=named.count)
        notes.append(
            f"of the subjects {', '.join(sorted(set(named)))} the one with most points was kept: {wanted}"
        )
    names, kept = [], []
    for column, label in enumerate(labels):
        name = label.rsplit(":", 1)[-1].strip()
        if wanted and subjects[column] not in ("", wanted):
            continue
        if name and not name.startswith("*") and name not in names:  # * = a point without a label
            names.append(name)
            kept.append(column)
    return tuple(names), kept, notes
