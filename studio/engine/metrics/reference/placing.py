"""Another motion in the stage frame and on the stage clock of a solve, with its alignment."""

import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studio.engine.base.arrays import read_arrays, save_arrays
from studio.engine.base.errors import FormatError
from studio.engine.base.files import write_atomically
from studio.engine.base.versions import PLACED
from studio.engine.metrics.reference.alignment import Alignment, align, clock_of
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.clock import on_one_clock
from studio.engine.metrics.reference.matching import match
from studio.engine.metrics.reference.reference import Markers, Reference
from studio.engine.metrics.results import Aligned
from studio.engine.model.poses import Poses


@dataclass(frozen=True)
class PlacedMotion:
    """A motion aligned with a solve.

    Attributes:
        motion: canonical joints in the stage frame, on the stage clock.
        aligned: its alignment.
    """

    motion: Reference
    aligned: Aligned

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the motion atomically as npz, in single precision.

        Raises:
            StudioError: the file cannot be written.
        """
        with write_atomically(path) as file:
            arrays = {
                "time_s": self.motion.time_s,
                "positions_m": self.motion.positions_m.astype(np.float32),
                "aligned": np.array(json.dumps(self.aligned)),
            }
            save_arrays(file, arrays, PLACED)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "PlacedMotion":
        """Return the motion that `save` wrote.

        Raises:
            FormatError: the file is missing, damaged or of a later version.
        """
        if not Path(path).is_file():
            raise FormatError(
                "reference.not_placed",
                "nothing was placed at {path}; align the reference with this solve first",
                path=path,
            )
        try:
            data = read_arrays(path, ("time_s", "positions_m", "aligned"), PLACED)
            motion = Reference(data["time_s"], data["positions_m"].astype(float))
            return cls(motion, json.loads(str(data["aligned"])))
        except FormatError:
            raise
        except Exception as error:  # zipfile and zlib raise their own errors for a damaged file
            raise FormatError(
                "reference.placed_damaged",
                "{path} is damaged: {error}; align the reference again",
                path=path,
                error=error,
            ) from error


def place(
    poses: Poses,
    reference: Reference | Markers,
    *,
    start_s: float | None = None,
    same_clock: bool = True,
    similarity: bool = False,
) -> PlacedMotion:
    """Return a reference in the stage frame of a solve, aligned as in `evaluate`.

    Raises:
        FormatError: solve and reference share too little time or too few joints.
    """
    centres, offsets_mm, clock = on_one_clock(poses, reference, start_s, same_clock)
    matched = match(poses, centres, start_s=start_s, offset_s=clock[0], drift_ppm=clock[1])
    _, fitted = align(matched, similarity=similarity)
    alignment = Alignment(fitted.T_reference_stage, fitted.scale, *clock)
    aligned: Aligned = {
        "kind": "similarity" if similarity else "rigid",
        **alignment.to_json(),
        "marker_offsets_mm": offsets_mm,
    }
    return PlacedMotion(on_stage(centres, alignment), aligned)


def on_stage(motion: Reference, alignment: Alignment) -> Reference:
    """Return a motion in the stage frame and on the stage clock."""
    time_s = (motion.time_s - alignment.offset_s) / (1.0 + alignment.drift_ppm * 1e-6)
    return Reference(time_s, alignment.to_stage(motion.positions_m))


def line_up(poses: Poses, other: Poses, *, start_s: float | None = None) -> Alignment:
    """Return the alignment in place and time of a solve of another take with the same movement.

    Both clocks are assumed equally fast; their offset is found from the speeds of the joints.

    Raises:
        FormatError: less than 2 s of motion, or no motion in common.
    """
    motion = Reference(other.time_s, canonical_positions(other))
    offset_s, drift_ppm = clock_of(poses, motion, start_s=start_s)
    matched = match(poses, motion, start_s=start_s, offset_s=offset_s, drift_ppm=drift_ppm)
    return Alignment(align(matched)[1].T_reference_stage, 1.0, offset_s, drift_ppm)
