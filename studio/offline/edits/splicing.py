"""Takes that are spliced from parts of other takes' solves."""

from collections.abc import Callable, Sequence
from pathlib import Path

from studio.engine.animation.splicing.splice import Part, spliced
from studio.engine.base.errors import SettingsError
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.engine.model.solve_metrics import SolveMetrics
from studio.offline.edits.take_parts import TakePart
from studio.take.folder.meta import PartMeta
from studio.take.folder.new import new_take
from studio.take.folder.solves import write_solve
from studio.take.folder.take import POSES, Take, check_free

SPLICED = "spliced"
"""Name of the solve."""

MOST_PARTS = 100


def splice_takes(
    parts: Sequence[TakePart],
    out: Path,
    *,
    times: int,
    blend_s: float,
    near_s: float,
    progress: Callable[[float], None] | None = None,
) -> Take:
    """Return a new take at `out` with the solve `spliced`; `take.json` records its parts.

    Args:
        parts: each with the name of its solve.
        out: a folder that does not exist or is empty.
        times: number of rounds through all parts; over 1 makes a loop.
        blend_s, near_s: as of `spliced`.
        progress: receives the share done.

    Raises:
        SettingsError: see `spliced`; or `times` that are not allowed.
        TakeError: `out` is not empty or cannot be written. No error leaves files behind.
        FormatError: a solve is damaged.
    """
    check_free(out)
    if not 1 <= times * max(len(parts), 1) <= MOST_PARTS or times < 1:
        raise SettingsError(
            "splice.times",
            "{times} times {n} parts: allowed are 1 to {most} parts in all",
            times=times,
            n=len(parts),
            most=MOST_PARTS,
        )
    used = [*parts] * times
    made = spliced([_part(one) for one in parts] * times, blend_s=blend_s, near_s=near_s)
    if progress is not None:
        progress(0.8)
    whole: list[PartMeta] = [
        {
            "take": one.take.meta["id"],
            "solve": one.solve or "",
            "performer": one.performer or "",
            "start_s": round(start_s, 4),
            "end_s": round(end_s, 4),
        }
        for one, (start_s, end_s) in zip(used, made.spans_s, strict=True)
    ]
    performer = parts[0].take.meta.get("performer", "")
    with new_take(out, source="splice", performer=performer) as take:
        take.meta["parts"] = whole
        metrics: SolveMetrics = {
            "frames": made.poses.frame_count,
            "seams_s": [[round(begin, 4), round(end, 4)] for begin, end in made.seams_s],
        }
        write_solve(take, SPLICED, settings=preset("raw"), poses=made.poses, metrics=metrics)
    if progress is not None:
        progress(1.0)
    return take


def _part(one: TakePart) -> Part:
    assert one.solve is not None
    poses = Poses.load(one.take.performer_folder(one.solve, one.performer) / POSES)
    begins_s = poses.begins_s if one.since_begin else 0.0
    start_s, end_s = (None if time_s is None else begins_s + time_s for time_s in (one.start_s, one.end_s))
    return Part(poses, start_s, end_s)
