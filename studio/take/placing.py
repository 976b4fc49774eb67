"""A take's reference brought to the stage of one of its solves, and kept beside the solve."""

import json
from pathlib import Path
from typing import Any

from studio.engine.files import write_json
from studio.take.references import HowAligned
from studio.take.take import Take


def place_reference(take: Path, poses: Path, reference: Path, how: HowAligned, out: Path) -> dict[str, Any]:
    """Bring a reference to the stage of the solve in `poses`, and keep it at `out`, with what was aligned away.

    Returns:
        `aligned` (as `Placed.aligned`), `joints`, and what of the solve is covered: `from_s` to `to_s` after its
        beginning.

    Raises:
        FormatError: it cannot be read, or shares too little time or too few joints with the solve.
    """
    from studio.engine.joints import CANONICAL
    from studio.engine.metrics.placing import place
    from studio.engine.metrics.reference import read_reference
    from studio.engine.poses import Poses

    solve = Poses.load(poses)
    placed = place(
        solve,
        read_reference(reference, unit_m=how.unit_m),
        start_s=Take.open(take).meta["calibration_s"],
        same_clock=not how.align_time,
        similarity=how.align == "similarity",
    )
    motion, start_s = placed.motion, float(solve.time_s[0])
    told = {
        "aligned": placed.aligned,
        "joints": [name for name, known in zip(CANONICAL, motion.known, strict=True) if known],
        "from_s": float(motion.time_s[0]) - start_s,
        "to_s": float(motion.time_s[-1]) - start_s,
    }
    placed.save(out)
    write_json(_told(out), told)
    return told


def placed_facts(out: Path) -> dict[str, Any] | None:
    """Return what `place_reference` told of a reference that is kept at `out`; None where there is none."""
    try:
        value = json.loads(_told(out).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return value if isinstance(value, dict) and out.is_file() else None


def _told(out: Path) -> Path:
    return out.with_suffix(".json")
