"""A first look at the edits of a take: the surroundings of an instant of a solve, solved with them."""

from collections.abc import Callable

from studio.engine.animation.splicing.retime import at_solve_times
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings
from studio.offline.edits.around import blended_into, solve_around
from studio.offline.preview import seen_performer
from studio.take.edits.carry import edits_of_solve
from studio.take.folder.solves import time_map
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
    """Return poses around an instant of a solve, solved with the take's edits and blended into its solve.

    Args:
        take: with raw frames, a calibration and the solve.
        settings: of the solve.
        solve: its name.
        at_s: time in the solve, which differs from stage time where its edits retime parts.
        performer: whose poses; the first's where empty.
        progress: receives the share done.

    Raises:
        TakeError, CalibrationError: as `solve_around`.
        FormatError: the solve is damaged.
    """
    stored = Poses.load(take.performer_folder(solve, performer or None) / POSES)
    edits, times = edits_of_solve(take).edits, time_map(take, solve)
    found = solve_around(
        take, settings, edits, float(times.stage_s(at_s)),
        performer=performer or PERFORMER, stored=None if times else stored, progress=progress,
    )  # fmt: skip
    if not times:
        return found
    first_s, last_s = times.solve_s(found.time_s[[0, -1]])
    shown_s = stored.time_s[(stored.time_s >= first_s) & (stored.time_s <= last_s)]
    return blended_into(at_solve_times(found, times, shown_s), stored)


def read_ahead(take: Take, settings: SolveSettings, *, performer: str = "") -> None:
    """Read what `look_at_edits` needs of a take, for the next call in this process, as a user begins to drag a joint.

    Args and errors: as `look_at_edits`.
    """
    seen_performer(take, settings, performer or PERFORMER).read_feet()
