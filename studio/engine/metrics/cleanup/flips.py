"""Limb flips: an elbow or knee that suddenly turns to the other side, and swapped left and right limbs.

An elbow or knee lies off the line from its limb's root to its end. A limb has flipped if the joint is over 3 cm off
the line before and after, and its direction turns about that line by over 90 degrees within 0.1 s and by 90 more than
the reference's. Left and right are exchanged if both ends of a pair of limbs (wrists, ankles) are less than half as
far from the other side's place in the reference as from their own, for at least 0.1 s, while the reference's ends
are over 20 cm apart.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from studio.engine.base.geometry import unit
from studio.engine.metrics.cleanup.events import CleanupEvent, events_of, joined, limb_of
from studio.engine.metrics.cleanup.shown import ShownMotion
from studio.engine.model.joints import INDEX

FLIP_DEG = 90.0
FLIP_S = 0.1
BENT_M = 0.03
APART_M = 0.20
_LIMBS = (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"))


def limb_flips(shown: ShownMotion, reference_m: NDArray[np.float64] | None) -> list[CleanupEvent]:
    """Return the flips of arms and legs.

    Args:
        reference_m: as for `pops.joint_pops`; swapped limbs need a reference.
    """
    events: list[CleanupEvent] = []
    frames = shown.frames(FLIP_S)
    for side in ("left", "right"):
        for names in _LIMBS:
            limb = [INDEX[f"{side}_{name}"] for name in names]
            turned = _turned_deg(shown.positions_m[:, limb], frames)
            own = np.zeros(len(turned)) if reference_m is None else _turned_deg(reference_m[:, limb], frames)
            own = maximum_filter1d(own, 2 * frames + 1, mode="nearest")
            events += events_of(
                "limb_flip", f"{side}_{names[1]}", shown.time_s, turned, turned - own > FLIP_DEG, unit="deg"
            )
    if reference_m is not None:
        for name in ("wrist", "ankle"):
            events += _swaps(shown, reference_m, name)
    return joined(events, lambda event: limb_of(event.joint))


def _turned_deg(limb_m: NDArray[np.float64], frames: int) -> NDArray[np.float64]:
    """Return the turn [deg] of the middle joint's direction off the limb's line, from half of `frames` before to half
    after, shape (sample_count,); 0 near the ends, where unknown, and where the limb is straight.
    """
    root, middle, end = np.moveaxis(limb_m, 1, 0)
    line = unit(end - root)
    off = middle - root
    off = off - (off * line).sum(axis=1, keepdims=True) * line
    out = np.zeros(len(off))
    before = frames // 2
    after = frames - before
    if len(off) <= frames:
        return out
    # the direction before is rotated with the line, so that a swinging limb does not count as a flip
    a, b = off[:-frames], off[frames:]
    a = _carried(a, line[:-frames], line[frames:])
    lengths = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        a, b = a / lengths[0][:, None], b / lengths[1][:, None]
    angle = np.degrees(2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)))
    bent = (lengths[0] > BENT_M) & (lengths[1] > BENT_M)
    out[before : len(off) - after] = np.where(bent & np.isfinite(angle), angle, 0.0)
    return out


def _carried(
    vectors: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Vectors rotated by the smallest rotation from unit directions `a` to `b`, shapes (sample_count, 3)."""
    axis = np.cross(a, b)
    cosine = (a * b).sum(axis=1, keepdims=True)
    along = (axis * vectors).sum(axis=1, keepdims=True) / np.maximum(1.0 + cosine, 1e-9)
    return cosine * vectors + np.cross(axis, vectors) + along * axis


def _swaps(shown: ShownMotion, reference_m: NDArray[np.float64], name: str) -> list[CleanupEvent]:
    """Times at which both joints of this name are swapped, less than half as far from the reference's other side."""
    columns = [INDEX[f"{side}_{name}"] for side in ("left", "right")]
    solve, reference = shown.positions_m[:, columns], reference_m[:, columns]
    own = np.linalg.norm(solve - reference, axis=2)
    other = np.linalg.norm(solve - reference[:, ::-1], axis=2)
    apart = np.linalg.norm(reference[:, 0] - reference[:, 1], axis=1) > APART_M
    swapped = (other < 0.5 * own).all(axis=1) & apart
    return events_of(
        "limb_flip",
        f"left_{name}",
        shown.time_s,
        own.max(axis=1) * 100.0,
        swapped,
        unit="cm",
        least_s=FLIP_S,
        detail="left and right swapped",
    )
