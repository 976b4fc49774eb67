"""Frozen limbs: an arm or leg that keeps its place on the trunk for over 0.3 s while the reference's moves.

Places are in the axes of the part of the trunk that carries the limb: shoulders and chest for arms, hips and spine
for legs. A limb is frozen while its middle joint and its end stay within 2 cm along every axis and the reference's
end moves over 10 cm. Without a reference it is frozen if it stays within 0.1 mm while another limb moves by over
10 cm; no living limb is that still.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.cleanup.events import CleanupEvent, events_of, joined, limb_of
from studio.engine.metrics.cleanup.shown import ShownMotion
from studio.engine.model.joints import INDEX

FROZEN_S = 0.3
STILL_M = 0.02
DEAD_STILL_M = 1e-4
MOVES_M = 0.10
_LIMBS = tuple(
    (f"{side}_{middle}", f"{side}_{end}")
    for side in ("left", "right")
    for middle, end in (("elbow", "wrist"), ("knee", "ankle"))
)


def frozen_limbs(shown: ShownMotion, reference_m: NDArray[np.float64] | None) -> list[CleanupEvent]:
    """Return the frozen limbs; the size is the duration [s].

    Args:
        reference_m: as for `pops.joint_pops`.
    """
    window = shown.frames(FROZEN_S) + 1
    if len(shown.time_s) < window:
        return []
    extents = {end: _extent_m(shown.positions_m, (middle, end), window) for middle, end in _LIMBS}
    events: list[CleanupEvent] = []
    for _, end in _LIMBS:
        if reference_m is None:
            others = np.max([extents[other] for _, other in _LIMBS if other != end], axis=0)
            frozen = (extents[end] < DEAD_STILL_M) & (others > MOVES_M)
        else:
            frozen = (extents[end] < STILL_M) & (_extent_m(reference_m, (end,), window) > MOVES_M)
        inside = np.zeros(len(shown.time_s), dtype=bool)
        for k in np.flatnonzero(frozen):
            inside[k : k + window] = True
        events += events_of("frozen_limb", end, shown.time_s, np.zeros(len(inside)), inside, unit="s")
    return [_with_time(event) for event in joined(events, lambda event: limb_of(event.joint))]


def _with_time(event: CleanupEvent) -> CleanupEvent:
    span = event.end_s - event.start_s
    return CleanupEvent(event.kind, event.joint, event.start_s, event.end_s, event.start_s, span, event.unit)


def _extent_m(positions_m: NDArray[np.float64], joints: tuple[str, ...], window: int) -> NDArray[np.float64]:
    """Return the largest extent of joints along the trunk's axes in each window, (sample_count - window + 1,)."""
    leg = joints[-1].endswith("ankle")
    left, right, low, high = (
        ("left_hip", "right_hip", "hips", "spine")
        if leg
        else ("left_shoulder", "right_shoulder", "spine", "neck")
    )
    across = positions_m[:, INDEX[left]] - positions_m[:, INDEX[right]]
    up = positions_m[:, INDEX[high]] - positions_m[:, INDEX[low]]
    x = across / np.linalg.norm(across, axis=1, keepdims=True)
    y = np.cross(up, x)
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    axes = np.stack([x, y, np.cross(x, y)], axis=1)
    root = positions_m[:, INDEX[joints[-1].split("_")[0] + ("_hip" if leg else "_shoulder")]]
    extents = []
    for joint in joints:
        local = (axes @ (positions_m[:, INDEX[joint]] - root)[..., None])[..., 0]
        views = np.lib.stride_tricks.sliding_window_view(local, window, axis=0)
        extents.append(np.ptp(views, axis=2).max(axis=1))
    return np.max(extents, axis=0)
