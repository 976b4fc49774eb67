"""A take's reference in the stage frame of one of its solves, stored with the solve."""

from pathlib import Path

import msgspec

from studio.engine.base.files import write_json
from studio.engine.metrics.results import Aligned
from studio.take.folder.references import HowAligned
from studio.take.folder.take import Take


class PlacedReference(msgspec.Struct):
    """A reference in the stage frame of a solve: its alignment, its canonical joints, and the covered part of the
    solve, first and last time after its beginning [s]."""

    aligned: Aligned
    joints: list[str]
    from_s: float
    to_s: float


def place_reference(take: Take, poses: Path, reference: Path, how: HowAligned, out: Path) -> PlacedReference:
    """Align a reference with the solve in `poses`, and store it at `out`, with its alignment.

    Raises:
        FormatError: it cannot be read, or shares too little time or too few joints with the solve.
    """
    from studio.engine.metrics.reference.placing import place
    from studio.engine.metrics.reference.reference import read_reference
    from studio.engine.model.poses import Poses

    solve = Poses.load(poses)
    placed = place(
        solve,
        read_reference(reference, unit_m=how.unit_m),
        start_s=take.meta["calibration_s"],
        same_clock=not how.align_time,
        similarity=how.align == "similarity",
    )
    motion, begins_s = placed.motion, solve.begins_s
    told = PlacedReference(
        aligned=placed.aligned,
        joints=motion.known_joints,
        from_s=float(motion.time_s[0]) - begins_s,
        to_s=float(motion.time_s[-1]) - begins_s,
    )
    placed.save(out)
    write_json(_told(out), msgspec.structs.asdict(told))
    return told


def placed_facts(out: Path) -> PlacedReference | None:
    """Return the result of `place_reference` for the reference at `out`; None if there is none."""
    try:
        told = msgspec.json.decode(_told(out).read_bytes(), type=PlacedReference)
    except (OSError, ValueError):
        return None
    return told if out.is_file() else None


def _told(out: Path) -> Path:
    return out.with_suffix(".json")
