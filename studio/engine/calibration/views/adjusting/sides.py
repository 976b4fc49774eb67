"""Left and right: the arms and legs that each camera has swapped, by frame.

Every combination of exchanges is tried; the one whose rays meet best is taken. Of two that meet equally well, the one
with fewer exchanges is taken.
"""

from collections.abc import Sequence
from itertools import product

import numpy as np

from studio.engine.calibration.views.adjusting.rig import CameraRig
from studio.engine.calibration.views.seen.bodies import Array, known_of
from studio.engine.calibration.views.seen.tracks import Sample, ViewTrack, nearest, nearest_time, sample
from studio.engine.calibration.views.seen.view import JOINTS, OTHER_SIDE

_ARMS = np.array(
    [i for i, n in enumerate(JOINTS) if n.split("_")[-1] in ("shoulder", "elbow", "wrist", "hand")]
)
_LEGS = np.array([i for i, n in enumerate(JOINTS) if n.split("_")[-1] in ("hip", "knee", "ankle", "toe")])
_MOST_CAMERAS = 5
_CLIPPED = 25.0
"""Largest cost of one landmark, in squared usual errors."""
_EXCHANGE_COST = 12.0
"""Minimum gain from exchanging one camera's arms or legs in one frame, in squared usual errors."""
_NEAR_S = 0.1
"""Largest time from a frame to the nearest instant, whose exchanges are applied to the frame."""


def find_swaps(rig: CameraRig, tracks: list[ViewTrack], times_s: Array) -> list[np.ndarray]:
    """Return, for each camera, whether each joint of each frame is exchanged, shape (frame_count, 17).

    Args:
        times_s: instants on the first camera's clock [s].
    """
    points, weight = at_instants(rig.ahead_s, tracks, times_s)
    out = [np.zeros(t.seen.shape, dtype=np.bool_) for t in tracks]
    ends = rig.ends_of(points)
    for group in (_ARMS, _LEGS):
        choice, _ = _choose(rig, points, ends, weight, group)
        for c, track in enumerate(tracks):
            at, away_s = nearest_time(times_s - rig.ahead_s[c], track.time_s)
            out[c][:, group] = (choice[at, c] & (away_s < _NEAR_S))[:, None]
    return out


def brought_together(
    rig: CameraRig, tracks: list[ViewTrack], times_s: Array
) -> tuple[list[np.ndarray], list[Sample], Array]:
    """Return the result of `find_swaps`, the corrected landmarks at the instants, and the places where rays meet.

    The places [m] have the shape (instant_count, 17, 3); NaN = unknown.
    """
    swapped = find_swaps(rig, tracks, times_s)
    samples = [
        sample(track.exchanged(swap), times_s - ahead)
        for track, swap, ahead in zip(tracks, swapped, rig.ahead_s, strict=True)
    ]
    joints = rig.meeting(np.stack([s.points for s in samples]), np.stack([s.weight for s in samples]))
    return swapped, samples, joints


def misfit(rig: CameraRig, tracks: list[ViewTrack], times_s: Array, loose: float) -> float:
    """Return the mean clipped squared error of a rig's rays, with left and right exchanged where that helps, in units
    of usual errors times `loose`."""
    points, weight = at_instants(rig.ahead_s, tracks, times_s)
    ends, loosened = rig.ends_of(points), weight / loose**2
    cost = sum(float(_choose(rig, points, ends, loosened, group)[1].sum()) for group in (_ARMS, _LEGS))
    return cost / max(int((weight > 0).sum()), 1)


def at_instants(
    ahead_s: Sequence[float] | Array, tracks: list[ViewTrack], times_s: Array
) -> tuple[Array, Array]:
    """Return the landmarks of the frames nearest to instants, shape (camera_count, instant_count, 17, 2), and their
    weights; 0 = unseen."""
    points, weights = [], []
    for track, ahead in zip(tracks, ahead_s, strict=True):
        rows, near = nearest(track, times_s - ahead)
        points.append(track.points[rows])
        weights.append(np.where(track.seen[rows] & near[:, None], track.sigma[rows] ** -2.0, 0.0))
    return np.stack(points), np.stack(weights)


def _choose(
    rig: CameraRig, points: Array, ends: Array, weight: Array, group: np.ndarray
) -> tuple[np.ndarray, Array]:
    """Return whether to exchange each camera's joints of a group, shape (instant_count, camera_count), and the cost
    of each instant; `ends`: a point on each pixel's ray."""
    cameras = len(points)
    most = 1 if cameras > _MOST_CAMERAS else cameras // 2
    ways = [way for way in product((False, True), repeat=cameras) if sum(way) <= most]
    costs = np.zeros((len(ways), points.shape[1]))
    for i, way in enumerate(ways):
        columns = [OTHER_SIDE[group] if exchanged else group for exchanged in way]
        p, e, w = (np.stack([of[c][:, columns[c]] for c in range(cameras)]) for of in (points, ends, weight))
        found = rig.meeting_of(e, w)
        known = known_of(found)
        shown, front = rig.show(np.where(known[..., None], found, 0.0))
        squares = np.where(
            front, np.minimum(((shown - p) ** 2).sum(axis=-1) * w, _CLIPPED), _CLIPPED * (w > 0)
        )
        costs[i] = np.where(known, squares, 0.0).sum(axis=(0, 2)) + _EXCHANGE_COST * sum(way)
    return np.array(ways)[costs.argmin(axis=0)], costs.min(axis=0)
