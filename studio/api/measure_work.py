"""What the server runs in worker processes to measure; imports stay inside, so that a process loads what it needs."""

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

from studio.report.words import Language
from studio.take.placing import place_reference
from studio.take.references import HowAligned

MAX_SAMPLES = 1200
"""Instants at which differences are told; a longer take is thinned to so many."""


def check_reference_work(file: Path) -> dict[str, Any]:
    """Return what a reference holds: `seconds`, `rate_hz`, `joints`, `kind` (`joints` or `markers`).

    Raises:
        FormatError: it cannot be read; the message names the file as it was sent.
    """
    import numpy as np

    from studio.engine.errors import FormatError
    from studio.engine.joints import CANONICAL
    from studio.engine.metrics.reference import Reference, read_reference

    try:
        motion = read_reference(file)
    except FormatError as error:
        raise FormatError(str(error).replace(str(file), file.name)) from error
    if isinstance(motion, Reference):
        joints = [name for name, known in zip(CANONICAL, motion.known, strict=True) if known]
    else:
        joints = list(motion.joints)
    steps = np.diff(motion.time_s)
    return {
        "kind": "joints" if isinstance(motion, Reference) else "markers",
        "seconds": round(float(motion.time_s[-1] - motion.time_s[0]), 3),
        "rate_hz": round(float(1.0 / np.median(steps)), 3),
        "joints": joints,
    }


def figures_work(take: Path, poses: Path, reference: Path | None, how: HowAligned) -> dict[str, Any]:
    """Return a solve's figures: `own`, and `reference`, as `evaluate --json` has them; null without a reference."""
    from studio.engine.metrics.own import own_figures
    from studio.engine.metrics.reference import read_reference
    from studio.engine.poses import Poses
    from studio.take.evaluating import evaluate_poses
    from studio.take.take import Take

    opened, solve, against = Take.open(take), Poses.load(poses), None
    if reference is not None:
        against = evaluate_poses(opened, solve, read_reference(reference, unit_m=how.unit_m), how)
    return {"own": own_figures(solve, start_s=opened.meta["calibration_s"]), "reference": against}


def evaluate_work(take: Path, reference: Path, solves: list[str], how: HowAligned) -> dict[str, Any]:
    """Return what `evaluate --json` holds for these solves of the take."""
    from studio.engine.metrics.reference import read_reference
    from studio.take.evaluating import evaluate_solves
    from studio.take.take import Take

    truth = read_reference(reference, unit_m=how.unit_m)
    return {"solves": evaluate_solves(Take.open(take), truth, solves, how)}


def report_work(take: Path, reference: Path, solves: list[str], how: HowAligned, language: Language) -> str:
    """Return the report of these solves of the take as HTML."""
    from studio.engine.metrics.reference import read_reference
    from studio.report.take_report import take_report
    from studio.report.words import Words
    from studio.take.evaluating import evaluate_solves
    from studio.take.take import Take

    opened, truth = Take.open(take), read_reference(reference, unit_m=how.unit_m)
    return take_report(opened, truth, evaluate_solves(opened, truth, solves, how), Words(language))


def difference_work(
    take: Path,
    a: Path,
    b: Path | None,
    reference: tuple[Path, HowAligned, Path] | None,
    apart: dict[str, Any],
) -> dict[str, Any]:
    """Return how far the solve `a` is from another motion over time.

    Args:
        take: of `a`; a, b: files `poses.npz`.
        b: the other solve; None where it is a reference.
        reference: its file, how it is aligned, and where it is kept when it has been brought to the stage of `a`.
        apart: `another_take`, whether `b` is of another take; `line_up`, bring it to the place and time of `a`;
            `offset_ms`, how far it is ahead in its own motion besides.
    """
    import numpy as np

    from studio.engine.metrics.alignment import Alignment
    from studio.engine.metrics.canonical import canonical_positions
    from studio.engine.metrics.compare import differences
    from studio.engine.metrics.placing import Placed, line_up, on_stage
    from studio.engine.metrics.reference import Reference
    from studio.engine.poses import Poses
    from studio.take.take import Take

    solve = Poses.load(a)
    start_s = Take.open(take).meta["calibration_s"]
    if b is None:
        assert reference is not None
        file, how, kept = reference
        if not kept.is_file():
            place_reference(take, a, file, how, kept)
        placed = Placed.load(kept)
        alignment, motion = Alignment(np.eye(4)), placed.motion
    else:
        other = Poses.load(b)
        alignment = Alignment(np.eye(4))
        if apart["line_up"]:
            alignment = line_up(solve, other, start_s=start_s)
        elif apart["another_take"]:
            alignment = Alignment(np.eye(4), offset_s=float(other.time_s[0] - solve.time_s[0]))
        motion = on_stage(Reference(other.time_s, canonical_positions(other)), alignment)
    moved = Reference(motion.time_s - apart["offset_ms"] * 1e-3, motion.positions_m)
    found = differences(solve, moved)
    return {
        **found.summary(),
        "alignment": alignment.to_json() if b is not None else None,
        "aligned": placed.aligned if b is None else None,
        **_samples(found),
    }


def _samples(found: Any) -> dict[str, Any]:
    """Differences at up to `MAX_SAMPLES` instants: the largest of each stretch, so that no peak is lost."""
    import numpy as np

    count = len(found.frames)
    edges = np.unique(np.linspace(0, count, min(count, MAX_SAMPLES) + 1).round().astype(int))
    mean = np.nanmean(found.mm, axis=1)
    rows = [int(low + np.argmax(mean[low:high])) for low, high in itertools.pairwise(edges)]

    def numbers(values: Any) -> list[float | None]:
        return [None if not np.isfinite(value) else round(float(value), 1) for value in values]

    return {
        "frame": found.frames[rows].tolist(),
        "mean_over_joints_mm": numbers(mean[rows]),
        "joints_mm": {name: numbers(found.mm[rows, j]) for j, name in enumerate(found.joints)},
        "per_joint_p95_mm": {
            name: float(np.nanpercentile(found.mm[:, j], 95)) for j, name in enumerate(found.joints)
        },
        "per_joint_max_mm": {name: float(np.nanmax(found.mm[:, j])) for j, name in enumerate(found.joints)},
    }


def write_report_work(
    take: Path,
    reference: Path,
    how: HowAligned,
    solves: list[str],
    out: Path,
    language: Language,
    *,
    progress: Callable[[float], None],
) -> None:
    """Write the report of these solves of the take to a file."""
    from studio.engine.metrics.reference import read_reference
    from studio.report.take_report import write_report
    from studio.report.words import Words
    from studio.take.evaluating import evaluate_solves
    from studio.take.take import Take

    opened, truth = Take.open(take), read_reference(reference, unit_m=how.unit_m)
    measured = len(solves) / (len(solves) + 1)
    figures = evaluate_solves(opened, truth, solves, how, progress=lambda share: progress(share * measured))
    write_report(out, opened, truth, figures, Words(language))
