"""The report of a take's solves, for the command and the server."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from studio.engine.base.errors import FormatError
from studio.engine.base.files import write_atomically
from studio.engine.base.sentences import system_says
from studio.engine.metrics.reference.reference import Markers, Reference, read_reference
from studio.engine.metrics.results import Evaluation, SeveralEvaluation
from studio.engine.model.poses import Poses
from studio.review.report.evaluation import MeasuredSolve, evaluation_report
from studio.review.report.performers import ReportedPerformer, performers_report
from studio.review.report.words import ENGLISH, Language, Words
from studio.take.folder.evaluating import evaluate_performers, evaluate_solves
from studio.take.folder.performers import performer_by_name, shown_name
from studio.take.folder.references import HowAligned
from studio.take.folder.solves import (
    read_settings,
    solve_camera_moves,
    solve_disagreements,
    undecided_spans,
)
from studio.take.folder.take import POSES, Take


def take_report(
    take: Take, reference: Reference | Markers, figures: Mapping[str, Evaluation], say: Words = ENGLISH
) -> str:
    """Return the report of a take's solves as HTML; `figures` are by solve, from `metrics.evaluate`."""
    solves = {
        name: MeasuredSolve(
            Poses.load(take.performer_folder(name) / POSES),
            one,
            read_settings(take.solve_folder(name)) or {},
            solve_disagreements(take.solve_folder(name)),
            solve_camera_moves(take.solve_folder(name)),
        )
        for name, one in figures.items()
    }
    title = say("Figures of {take}", take=take.path.name)
    return evaluation_report(title, solves, reference, start_s=take.meta["calibration_s"], say=say)


def several_report(
    take: Take,
    references: Mapping[str, Reference | Markers],
    figures: Mapping[str, SeveralEvaluation],
    say: Words = ENGLISH,
) -> str:
    """Return the report of solves with several performers as HTML.

    Args:
        references: by performer, in the order of the sections.
        figures: by solve, from `evaluate_performers` with these references.
    """
    performers = []
    for key, reference in references.items():
        performer = performer_by_name(take.meta, key)
        folders = {solve: take.performer_folder(solve, performer) for solve in figures}
        solves = {
            solve: MeasuredSolve(
                Poses.load(folder / POSES),
                figures[solve]["performers"][key],
                read_settings(take.solve_folder(solve)) or {},
                solve_disagreements(folder),
                solve_camera_moves(take.solve_folder(solve)),
                together=True,
            )
            for solve, folder in folders.items()
        }
        doubts = {solve: undecided_spans(folder) for solve, folder in folders.items()}
        performers.append(ReportedPerformer(shown_name(take.meta, performer), key, solves, reference, doubts))
    title = say("Figures of {take}", take=take.path.name)
    return performers_report(title, performers, figures, start_s=take.meta["calibration_s"], say=say)


def write_report(path: Path, page: str) -> None:
    """Write a report to a file, atomically.

    Raises:
        FormatError: the file cannot be written.
    """
    try:
        with write_atomically(path) as file:
            file.write(page.encode())
    except OSError as error:
        raise FormatError(
            "report.unwritable",
            "cannot write {path}: {error}; choose another --report",
            path=path,
            error=system_says(error),
        ) from error


def report_solves(
    take: Take,
    reference: Path | Mapping[str, Path],
    solves: Sequence[str],
    how: HowAligned,
    language: Language,
    out: Path | None = None,
    *,
    progress: Callable[[float], None] | None = None,
) -> str | None:
    """Measure solves of a take and report them, as returned HTML or in the file `out`.

    Args:
        reference: file of the reference; for several performers, the files by performer, where they exist.
        solves: names; the others are compared with the first.
        how: options of the reference's alignment.
        progress: receives the share done.

    Raises:
        FormatError: a file that cannot be read or written.
        TakeError: a solve has no such performer.
        StudioError: they cannot be aligned with the reference.
    """
    told, measured, say = progress or (lambda share: None), len(solves) / (len(solves) + 1), Words(language)

    def measuring(share: float) -> None:
        told(share * measured)

    if isinstance(reference, Path):
        motion = read_reference(reference, unit_m=how.unit_m)
        made = take_report(take, motion, evaluate_solves(take, motion, solves, how, progress=measuring), say)
    else:
        motions = {key: read_reference(file, unit_m=how.unit_m) for key, file in reference.items()}
        figures = evaluate_performers(take, motions, solves, how, progress=measuring)
        made = several_report(take, motions, figures, say)
    if out is None:
        return made
    write_report(out, made)
    return None
