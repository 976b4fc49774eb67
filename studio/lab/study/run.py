"""Runs the cells of a study on every core. Existing cells are reused."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import msgspec

from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import system_says
from studio.lab.study.plan import Cell, Study
from studio.lab.study.results import CellJson

CELLS = "cells"
"""Name of the folder of cell files in the study's folder."""

_LOOK_S = 1.0
"""Interval between counts of finished cells."""


def run_study(
    study: Study, out: Path, *, processes: int | None = None, progress: Callable[[float], None] | None = None
) -> int:
    """Make every missing cell; return the number made.

    A cell is one file, written atomically, so an interrupted study can be continued.

    Args:
        study: the plan.
        out: folder of the study.
        processes: number of processes; None = one per core.
        progress: receives the share of all cells done.

    Raises:
        StudioError: the folder cannot be written, or a process ended early.
    """
    folder = out / CELLS
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudioError(
            "study.unwritable",
            "cannot write {folder}: {error}; choose another --out",
            folder=folder,
            error=system_says(error),
        ) from error
    missing = {
        recording: [cell for cell in cells if read_cell(out, cell) is None]
        for recording, cells in study.by_recording().items()
    }
    total = len(study.cells)
    there = total - sum(map(len, missing.values()))
    if progress is not None:
        progress(there / max(total, 1))
    others = {cell.variant.name: cell.variant for cell in study.cells}
    jobs = [(recording, cells) for recording, cells in missing.items() if cells]
    if not jobs:
        return 0
    from studio.lab.study.cell import run_recording

    count = min(processes or os.cpu_count() or 1, len(jobs))
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, mp_context=context, initializer=_begin) as pool:
        futures = [pool.submit(run_recording, recording, cells, others, folder) for recording, cells in jobs]
        try:
            left = set(futures)
            while left:
                ended, left = wait(left, timeout=_LOOK_S)
                for future in ended:
                    future.result()
                if progress is not None:
                    progress(sum(_path(out, cell).is_file() for cell in study.cells) / total)
        except BrokenProcessPool as error:
            raise StudioError(
                "study.broke_off", "a process of the study broke off; start it again, and it continues"
            ) from error
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return total - there


def _begin() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # only the command handles Ctrl-C; it ends its processes
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process with its parent, so that a killed command leaves none running. Cell files stay intact."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _path(out: Path, cell: Cell) -> Path:
    return out / CELLS / f"{cell.key}.json"


def read_cell(out: Path, cell: Cell) -> CellJson | None:
    """Return the figures of a cell; None if its file is missing or damaged."""
    try:
        return msgspec.json.decode(_path(out, cell).read_bytes(), type=CellJson)
    except (OSError, ValueError):
        return None


def read_cells(study: Study, out: Path) -> list[CellJson]:
    """Return all existing cells of a study."""
    found = (read_cell(out, cell) for cell in study.cells)
    return [value for value in found if value is not None]
