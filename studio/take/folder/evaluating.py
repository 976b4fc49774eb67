"""Evaluation of a take's solves against a reference, for the command, the API and batches."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from studio.engine.metrics.results import Evaluation, SeveralEvaluation
from studio.take.folder.references import HowAligned
from studio.take.folder.solves import read_metrics, undecided_spans
from studio.take.folder.take import POSES, Take

if TYPE_CHECKING:
    from studio.engine.metrics.reference.reference import Markers, Reference
    from studio.engine.model.poses import Poses


def evaluate_solves(
    take: Take,
    reference: "Reference | Markers",
    solves: Sequence[str],
    how: HowAligned,
    *,
    progress: Callable[[float], None] | None = None,
) -> dict[str, Evaluation]:
    """Return the figures of a take's solves by name, as from `metrics.evaluate`; `progress` receives 0 to 1.

    With several performers, they are the figures of the one whose motion the reference is.

    Raises:
        TakeError: a solve has no such performer.
        FormatError: a solve is missing or damaged.
        StudioError: it cannot be aligned with the reference.
    """
    from studio.engine.model.poses import Poses

    figures = {}
    for k, name in enumerate(solves):
        poses = Poses.load(take.performer_folder(name, how.performer) / POSES)
        figures[name] = evaluate_poses(take, poses, reference, how)
        if progress is not None:
            progress((k + 1) / len(solves))
    return figures


def evaluate_performers(
    take: Take,
    references: "Mapping[str, Reference | Markers]",
    solves: Sequence[str],
    how: HowAligned,
    *,
    progress: Callable[[float], None] | None = None,
) -> dict[str, SeveralEvaluation]:
    """Return the figures of solves of several performers by name of the solve; `references` by performer.

    Raises:
        TakeError: a solve has no such performer.
        FormatError: a solve is damaged.
        StudioError: it cannot be aligned with the references.
    """
    from studio.engine.metrics.several import evaluate_several
    from studio.engine.model.poses import Poses

    figures = {}
    for k, name in enumerate(solves):
        folders = {performer: take.performer_folder(name, performer) for performer in references}
        figures[name] = evaluate_several(
            {performer: Poses.load(folder / POSES) for performer, folder in folders.items()},
            references,
            undecided_s={performer: undecided_spans(folder) for performer, folder in folders.items()},
            recorded_s=(read_metrics(take.solve_folder(name)) or {}).get("recorded_s"),
            start_s=take.meta["calibration_s"],
            same_clock=not how.align_time,
            similarity=how.align == "similarity",
        )
        if progress is not None:
            progress((k + 1) / len(solves))
    return figures


def evaluate_references(
    take: Take, references: Mapping[str, Path], solves: Sequence[str], how: HowAligned
) -> dict[str, SeveralEvaluation]:
    """Return the figures as `evaluate_performers`; `references` are files by performer.

    Raises:
        FormatError: a file that cannot be read.
        TakeError, StudioError: as `evaluate_performers`.
    """
    from studio.engine.metrics.reference.reference import read_reference

    motions = {name: read_reference(file, unit_m=how.unit_m) for name, file in references.items()}
    return evaluate_performers(take, motions, solves, how)


def evaluate_poses(
    take: Take, poses: "Poses", reference: "Reference | Markers", how: HowAligned
) -> Evaluation:
    """Return the figures of poses of a take; the calibration part at its beginning does not count.

    Raises:
        StudioError: they cannot be aligned with the reference.
    """
    from studio.engine.metrics.evaluate import evaluate

    return evaluate(
        poses,
        reference,
        start_s=take.meta["calibration_s"],
        same_clock=not how.align_time,
        similarity=how.align == "similarity",
    )
