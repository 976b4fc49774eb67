"""A take's reference brought to the stage of one of its solves, and kept beside the solve."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.take.references import HowAligned
from studio.take.take import Take

if TYPE_CHECKING:
    from studio.engine.metrics.placing import Placed


def place_reference(take: Path, poses: Path, reference: Path, how: HowAligned, out: Path) -> "Placed":
    """Return a reference on the stage of the solve in `poses`, which is kept at `out`.

    Raises:
        FormatError: it cannot be read, or shares too little time or too few joints with the solve.
    """
    from studio.engine.metrics.placing import place
    from studio.engine.metrics.reference import read_reference
    from studio.engine.poses import Poses

    placed = place(
        Poses.load(poses),
        read_reference(reference, unit_m=how.unit_m),
        start_s=Take.open(take).meta["calibration_s"],
        same_clock=not how.align_time,
        similarity=how.align == "similarity",
    )
    placed.save(out)
    return placed


def place_and_tell(take: Path, poses: Path, reference: Path, how: HowAligned, out: Path) -> dict[str, Any]:
    """Do as `place_reference`; return what was aligned away (`aligned`), `joints`, and what of the solve is covered:
    `from_s` to `to_s` after its beginning."""
    from studio.engine.joints import CANONICAL
    from studio.engine.poses import Poses

    placed = place_reference(take, poses, reference, how, out)
    motion, start_s = placed.motion, float(Poses.load(poses).time_s[0])
    return {
        "aligned": placed.aligned,
        "joints": [name for name, known in zip(CANONICAL, motion.known, strict=True) if known],
        "from_s": float(motion.time_s[0]) - start_s,
        "to_s": float(motion.time_s[-1]) - start_s,
    }
