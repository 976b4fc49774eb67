"""The offers for a stored solve: its clean-up events, what caused each, and the edit that would mend it."""

from dataclasses import replace

import msgspec

from studio.engine.base.errors import TakeError
from studio.engine.edits.edit import Edit
from studio.engine.edits.time_map import TimeMap
from studio.engine.model.poses import Poses
from studio.engine.whole_take.trace import Trace
from studio.offline.edits.offers import Offer, offers
from studio.take.folder.solves import TRACE, time_map
from studio.take.folder.take import PERFORMER, POSES, Take


def offers_of_solve(take: Take, solve: str, performer: str = "") -> list[Offer]:
    """Return the offers for a solve of a take, in order of time.

    Args:
        take: with the solve.
        solve: its name.
        performer: of several; the first where empty.

    Raises:
        TakeError: the solve has no trace of what went into it, like a live or imported one.
        FormatError: it is damaged.
    """
    folder = take.performer_folder(solve, performer or None)
    if not (folder / TRACE).is_file():
        raise TakeError(
            "offers.no_trace",
            "solve {name!r} does not say what went into it; solve the take again",
            name=solve,
        )
    poses, trace = Poses.load(folder / POSES), Trace.load(folder / TRACE)
    found = offers(poses, trace, start_s=take.meta["calibration_s"], performer=performer or PERFORMER)
    times = time_map(take, solve)
    return [replace(one, edits=tuple(_in_stage_time(edit, times) for edit in one.edits)) for one in found]


def _in_stage_time(edit: Edit, times: TimeMap) -> Edit:
    """Return an edit that was made in the time of a solve."""
    start_s, end_s = times.stage_s([edit.start_s, edit.end_s]).tolist()
    return msgspec.structs.replace(edit, start_s=start_s, end_s=end_s) if times else edit
