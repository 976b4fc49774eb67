"""The report of a take's solves, as the command and the server write it."""

from pathlib import Path
from typing import Any

from studio.engine.errors import FormatError
from studio.engine.files import write_atomically
from studio.engine.metrics.reference import Markers, Reference
from studio.engine.poses import Poses
from studio.report.evaluation import Measured, evaluation_report
from studio.report.words import ENGLISH, Words
from studio.take.solves import read_settings
from studio.take.take import Take


def take_report(
    take: Take, reference: Reference | Markers, figures: dict[str, dict[str, Any]], say: Words = ENGLISH
) -> str:
    """Return the report of a take's solves as HTML; `figures` by solve, as `metrics.evaluate` gives them."""
    solves = {
        name: Measured(
            Poses.load(take.solve_folder(name) / "poses.npz"),
            one,
            read_settings(take.solve_folder(name)) or {},
        )
        for name, one in figures.items()
    }
    title = say("Figures of {take}", take=take.path.name)
    return evaluation_report(title, solves, reference, start_s=take.meta["calibration_s"], say=say)


def write_report(
    path: Path,
    take: Take,
    reference: Reference | Markers,
    figures: dict[str, dict[str, Any]],
    say: Words = ENGLISH,
) -> None:
    """Write the report to a file, whole or not at all.

    Raises:
        FormatError: the file cannot be written.
    """
    page = take_report(take, reference, figures, say)
    try:
        with write_atomically(path) as file:
            file.write(page.encode())
    except OSError as error:
        raise FormatError(f"cannot write {path}: {error.strerror}; choose another --report") from error
