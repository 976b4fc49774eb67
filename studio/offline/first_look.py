"""A first look at the edits of a take: what is around an instant of a solve, solved with them."""

from collections.abc import Callable

from studio.engine.model.poses import Poses
from studio.engine.model.settings import SolveSettings
from studio.offline.around import solve_around
from studio.take.edits.carry import edits_of_solve
from studio.take.folder.take import PERFORMER, POSES, Take


def look_at_edits(
    take: Take,
    settings: SolveSettings,
    solve: str,
    at_s: float,
    *,
    performer: str = "",
    progress: Callable[[float], None] | None = None,
) -> Poses:
    """Return poses around a stage time [s], solved with the take's edits and blended into its solve.

    Args:
        take: with raw frames, a calibration and the solve.
        settings: of the solve.
        solve: its name.
        at_s: the stage time.
        performer: whose poses; the first's where empty.
        progress: receives the share done.

    Raises:
        TakeError, CalibrationError: as `solve_around`.
        FormatError: the solve is damaged.
    """
    stored = Poses.load(take.performer_folder(solve, performer or None) / POSES)
    return solve_around(
        take, settings, edits_of_solve(take).edits, at_s,
        performer=performer or PERFORMER, stored=stored, progress=progress,
    )  # fmt: skip
