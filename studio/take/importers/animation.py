"""Imports of animations: a take without raw, whose only solve is `imported`."""

from collections.abc import Callable
from pathlib import Path

from studio.engine.animation.read.files import ENDINGS
from studio.engine.animation.read.imported import imported_poses
from studio.engine.base.sentences import say
from studio.engine.model.settings.settings import preset
from studio.engine.model.solve_metrics import SolveMetrics
from studio.take.folder.new import new_take
from studio.take.folder.solves import write_solve
from studio.take.folder.take import Take, check_free

IMPORTED = "imported"
"""Name of the solve."""

ANIMATIONS = say("import.kind_animation", "an animation ({endings})", endings=[*ENDINGS])
"""Files for which `is_animation` is true, in words."""


def is_animation(path: Path) -> bool:
    """Whether a file is an animation by its ending."""
    return path.suffix.lower() in ENDINGS


def import_animation(
    path: Path, out: Path, *, unit_m: float | None, progress: Callable[[float], None]
) -> Take:
    """Return a new take at `out` with the solve `imported` of the animation at `path`.

    Raises:
        FormatError, NotAvailableError, SettingsError: as `imported_poses`.
        TakeError: `out` is not empty or cannot be written. No error leaves files behind.
    """
    check_free(out)
    progress(0.05)
    poses, notes = imported_poses(path, unit_m=unit_m, progress=lambda share: progress(0.05 + 0.85 * share))
    progress(0.9)
    notes = [
        f"animation: {path.name}, {poses.frame_count} frames at {poses.frames_per_second:.6g} Hz",
        *notes,
    ]
    with new_take(out, source="import", notes="\n".join(notes)) as take:
        metrics: SolveMetrics = {"frames": poses.frame_count, "source": path.name}
        write_solve(take, IMPORTED, settings=preset("raw"), poses=poses, metrics=metrics)
    progress(1.0)
    return take
