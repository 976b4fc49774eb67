"""Self-penetration: two body parts that overlap by over 2 cm more than the reference's do.

Parts are capsules on the bones. Radii are shares of stature: the smallest of half of ANSUR's breadths and depths and
of its girths divided by 2 pi, so that soft flesh does not count (Gordon et al., "2012 Anthropometric Survey of U.S.
Army Personnel", NATICK/TR-15/007, 2014, means of men and women over the mean stature of 1.72 m). Parts that share a
joint or are adjacent along a limb are not compared, nor are thighs, which touch in people who stand.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import nearest_on_segments
from studio.engine.metrics.cleanup.events import CleanupEvent, events_of, joined
from studio.engine.metrics.cleanup.shown import ShownMotion
from studio.engine.model.joints import INDEX

DEPTH_M = 0.02
USUAL_HEIGHT_M = 1.72

_TRUNK_RADIUS = 0.058
"""Share of stature: less than half of the waist's depth (0.22 m), since a capsule is round and a trunk is broad."""

# part: start, end, radius as a share of stature
_PARTS: dict[str, tuple[str, str, float]] = {
    "trunk": ("hips", "neck", _TRUNK_RADIUS),
    "head": ("neck", "head", 0.040),
    **{
        f"{side}_{part}": (f"{side}_{start}", f"{side}_{end}", radius)
        for side in ("left", "right")
        for part, start, end, radius in (
            ("forearm", "elbow", "wrist", 0.020),
            ("hand", "wrist", "hand", 0.012),
            ("thigh", "hip", "knee", 0.042),
            ("shank", "knee", "ankle", 0.024),
            ("foot", "ankle", "toe", 0.018),
        )
    },
}
_PAIRS: tuple[tuple[str, str], ...] = (
    *((f"{side}_{part}", whole) for side in ("left", "right") for part in ("forearm", "hand")
      for whole in ("trunk", "head", "left_thigh", "right_thigh", "left_shank", "right_shank")),
    *((f"left_{a}", f"right_{b}") for a in ("forearm", "hand") for b in ("forearm", "hand")),
    *((f"left_{a}", f"right_{b}") for a in ("thigh", "shank", "foot") for b in ("thigh", "shank", "foot")
      if (a, b) != ("thigh", "thigh")),
)  # fmt: skip


def self_penetrations(shown: ShownMotion, reference_m: NDArray[np.float64] | None) -> list[CleanupEvent]:
    """Return the overlaps of body parts, one event per pair of parts at a time.

    Args:
        reference_m: as for `pops.joint_pops`.
    """
    height = _height_m(shown)
    events: list[CleanupEvent] = []
    for a, b in _PAIRS:
        depth = _depth_m(shown.positions_m, a, b, height)
        beside = np.zeros(len(depth))
        if reference_m is not None:
            beside = np.nan_to_num(np.maximum(_depth_m(reference_m, a, b, height), 0.0))
        excess = depth - beside
        events += events_of(
            "self_penetration",
            _PARTS[a][1],
            shown.time_s,
            excess * 100.0,
            excess > DEPTH_M,
            unit="cm",
            detail=f"{a} in {b}".replace("_", " "),
        )
    return joined(events, lambda event: _where(event))


def _where(event: CleanupEvent) -> str:
    """The two limbs that meet; a hand and its forearm in the trunk are corrected together."""
    words = event.detail.split(" in ")
    return " ".join(
        {"forearm": "arm", "hand": "arm", "thigh": "leg", "shank": "leg", "foot": "leg"}.get(w, w)
        for word in words
        for w in word.split()
    )


def _height_m(shown: ShownMotion) -> float:
    """Return the stature [m] from the rest pose, in which the head's joint is at 0.936 of it; else the usual one."""
    head = float(shown.rest_m[INDEX["head"], 2])
    return head / 0.936 if np.isfinite(head) and head > 0.3 else USUAL_HEIGHT_M


def _depth_m(positions_m: NDArray[np.float64], a: str, b: str, height_m: float) -> NDArray[np.float64]:
    """Overlap of two parts [m], shape (sample_count,); negative = apart, NaN = unknown."""
    start_a, end_a, radius_a = _PARTS[a]
    start_b, end_b, radius_b = _PARTS[b]
    distance = segment_distance_m(*(positions_m[:, INDEX[name]] for name in (start_a, end_a, start_b, end_b)))
    return (radius_a + radius_b) * height_m - distance


def segment_distance_m(
    a0: NDArray[np.float64], a1: NDArray[np.float64], b0: NDArray[np.float64], b1: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the least distance between segments a0 a1 and b0 b1 [m]; each (sample_count, 3) -> (sample_count,)."""
    return np.linalg.norm(nearest_on_segments(a0, a1, b0, b1)[2], axis=1)
