"""What the server runs in worker processes; imports stay inside, so that a process loads what it needs only."""

from collections.abc import Callable
from pathlib import Path
from typing import Any


def solve_work(
    path: Path, settings: dict[str, Any], name: str, as_live: bool, *, progress: Callable[[float], None]
) -> None:
    """Solve the take at `path`; `settings` as `SolveSettings.to_json`."""
    from studio.engine.settings import SolveSettings
    from studio.replay import solve_take
    from studio.take.take import Take

    solve_take(
        Take.open(path), SolveSettings.from_json(settings), name=name, as_live=as_live, progress=progress
    )


def export_work(poses: Path, out: Path, format: str, fps: float | None, interpolation: str) -> None:
    """Export the `poses.npz` to `out`."""
    from studio.engine.export import export
    from studio.engine.poses import Poses

    export(Poses.load(poses), out, format, fps=fps, interpolation=interpolation)
