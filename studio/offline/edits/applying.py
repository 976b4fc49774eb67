"""Selection of the offered edits that mend a solve: they remove their events, and nothing speaks against them."""

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.edits.edit import Edit, LeaveOutEdit
from studio.engine.metrics.cleanup.events import LIMB_OF, limb_of
from studio.engine.metrics.cleanup.solve import solve_cleanup
from studio.engine.metrics.results import CleanupEventJson
from studio.engine.model.joints import CANONICAL, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.poses import Poses
from studio.engine.whole_take.trace import Trace
from studio.offline.edits.offers import ABOUT_S, Offer

Solve = Callable[[Sequence[Edit]], Poses]
"""Solves the take with edits."""

NEAR_S, MOVED_M = 0.5, 0.005
"""Time from an edit beyond which nothing may move [s], and the movement that counts [m]."""

LEAST_M, MOST_SHARE, FAR_M = 0.001, 0.2, 0.2
"""Limits of an edit that agrees with the cameras: the limb's least movement in a frame that counts [m], the largest
share of the movement that may lead away from the cameras' joints, and the cap of a joint's distance [m].
"""


def apply_offers(
    found: Sequence[Offer], before: Poses, trace: Trace, solve: Solve, *, start_s: float | None = None
) -> tuple[list[Edit], Poses]:
    """Return the offered edits that remove their events, create no other, move nothing else and do not contradict the
    cameras, and the solve with them.

    All are tried at once. Those that a solve proves wrong are left out of the next, until none is wrong. An error
    elsewhere counts against the nearest edit. Then the remaining events' next edits are tried with the kept ones.

    Args:
        found: by `offers`.
        before: the solve without them.
        trace: its inputs, with as many frames.
        solve: with some of them; its frames are those of `before`.
        start_s: as for `offers`.
    """
    kept: dict[int, Edit] = {}
    best, left = before, solve_cleanup(before, start_s=start_s)["cleanup_events"] or []
    old = left
    for turn in range(max((len(offer.edits) for offer in found), default=0)):
        fresh = {
            k: offer.edits[turn]
            for k, offer in enumerate(found)
            if k not in kept and turn < len(offer.edits) and _still(offer.event, left)
        }
        while fresh:
            tried = kept | fresh
            after = solve(list(tried.values()))
            new = solve_cleanup(after, start_s=start_s)["cleanup_events"] or []
            wrong = {
                k
                for k, edit in tried.items()
                if _still(found[k].event, new) or _contradicts(edit, found[k].joint, before, after, trace)
            }
            times = [found[k].event["peak_s"] for k in wrong & kept.keys()]
            times += [one["peak_s"] for one in new if not _still(one, old)]
            times += _moved_outside_s(tried.values(), before, after)
            wrong |= {_nearest(fresh, at_s) for at_s in times}
            if not wrong:
                kept, best, left = tried, after, new
                break
            fresh = {k: edit for k, edit in fresh.items() if k not in wrong}
    return list(kept.values()), best


def _still(event: CleanupEventJson, events: Sequence[CleanupEventJson]) -> bool:
    """Whether an event is among others: of its kind and limb, at the same time."""
    return any(
        one["kind"] == event["kind"]
        and limb_of(one["joint"]) == limb_of(event["joint"])
        and one["start_s"] <= event["end_s"] + ABOUT_S
        and one["end_s"] >= event["start_s"] - ABOUT_S
        for one in events
    )


def _nearest(tried: Mapping[int, Edit], at_s: float) -> int:
    """The edit nearest to a time, by its key."""
    return min(tried, key=lambda k: max(tried[k].start_s - at_s, at_s - tried[k].end_s, 0.0))


def _moved_outside_s(tried: Iterable[Edit], before: Poses, after: Poses) -> list[float]:
    """Times of frames that moved too far away from any edit [s]."""
    moved = np.linalg.norm(after.positions_m - before.positions_m, axis=2).max(axis=1) > MOVED_M
    for edit in tried:
        moved &= (before.time_s < edit.start_s - NEAR_S) | (before.time_s > edit.end_s + NEAR_S)
    return before.time_s[moved].tolist()


def _contradicts(edit: Edit, joint: str, before: Poses, after: Poses, trace: Trace) -> bool:
    """Whether a limb moves away from where the cameras saw it; observations that the edit leaves out do not count."""
    limb = np.array([name == limb_of(joint) for name in LIMB_OF])
    outputs = OUTPUT_OF_CANONICAL_INDEX[limb]
    near = (before.time_s > edit.start_s - NEAR_S) & (before.time_s < edit.end_s + NEAR_S)
    way = np.linalg.norm(after.positions_m[:, outputs] - before.positions_m[:, outputs], axis=2).mean(axis=1)
    rows = np.flatnonzero(near & (way > LEAST_M))
    if not len(rows):
        return False
    seen, used = trace.seen(rows)
    if isinstance(edit, LeaveOutEdit):
        cameras = [edit.camera in (None, name) for name in trace.cameras]
        used &= ~np.outer(cameras, np.isin(CANONICAL, edit.joints))
    used, seen = used[:, :, limb], seen[:, :, limb]
    farther = _distances(after, rows, outputs, seen) - _distances(before, rows, outputs, seen)
    return bool(used.any()) and farther[used].mean() > MOST_SHARE * way[rows].mean()


def _distances(
    poses: Poses, rows: NDArray[np.int64], outputs: NDArray[np.int64], seen: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Clipped distances of the cameras' joints [m], shape (row_count, camera_count, joint_count)."""
    away = seen - poses.positions_m[rows[:, None], outputs][:, None]
    return np.minimum(np.linalg.norm(away, axis=3), FAR_M)
