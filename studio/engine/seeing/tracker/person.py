"""Clusters of the performer: chosen once, then tracked by the body's prediction."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.model.human.humanoid import BODY_JOINTS
from studio.engine.seeing.fitting.chain import Pose
from studio.engine.seeing.fitting.fit import BodyShape, Fitter, MeasuredPoints
from studio.engine.seeing.tracker.view import ImageClusters

Array = NDArray[np.float64]

_HEIGHT_M = (0.7, 2.75)
"""Height of the highest point, which may be a tall person's raised hand [m]."""
_TALL_M, _TRUNK_M = 0.5, 0.3
"""Least height of the visible part of a person, and of a person whose legs are not read [m]."""
_FLOATS_M, _HOLE_SHARE = 0.2, 0.3
"""Height of a cluster above the floor [m], and unread share below it, beyond which its legs count as unread."""
_WIDEST_M = 2.4
_LEAST_AREA_M2, _MOST_AREA_M2 = 0.08, 1.8
_BESIDE_M = 0.45
_NEAR_M = 0.22
_NEAR_SHARE = 0.4
LOOKED_AT = 40
_TOUCHED_SHARE = 0.02
_REACH_M = 1.6
_CHEST = BODY_JOINTS.index("Spine2")
_LIMB_AREA_M2, _LIMB_REACH_M = 0.12, 0.85


def may_be_person(seen: ImageClusters) -> NDArray[np.bool_]:
    """Return which clusters have a standing person's size, shape (cluster_count,)."""
    k = seen.clusters
    size = k.high - k.low
    sized = (
        (k.high[:, 2] > _HEIGHT_M[0]) & (k.high[:, 2] < _HEIGHT_M[1])
        & (np.hypot(size[:, 0], size[:, 1]) < _WIDEST_M) & (size[:, 2] > _TRUNK_M)
        & (k.area > _LEAST_AREA_M2) & (k.area < _MOST_AREA_M2)
    )  # fmt: skip
    for low in np.flatnonzero(sized & (size[:, 2] <= _TALL_M)):
        sized[low] = k.low[low, 2] > _FLOATS_M and _over_a_hole(seen, int(low))
    return sized


def _over_a_hole(seen: ImageClusters, cluster: int) -> bool:
    """Whether enough cells are unread below a cluster, halfway to the floor."""
    k = seen.clusters
    rows, columns = np.nonzero(k.labels == cluster)
    tall = int(np.ptp(rows)) + 1
    low, end = k.low[cluster, 2], int(rows.max()) + 1
    reach = int(0.5 * tall * low / (k.high[cluster, 2] - low))
    foot = columns[rows > end - 1 - tall / 4]
    below = seen.depth[end : end + reach, foot.min() : foot.max() + 1]
    return below.size > 0 and bool((below <= 0.0).mean() > _HOLE_SHARE)


def candidates(views: dict[str, ImageClusters], centre: Array | None) -> list[Array]:
    """Return possible places of people, x and y [m], the most likely performer first.

    Args:
        centre: middle of the stage, x and y; None for the line straight ahead of the camera, near before far.
    """
    found = []
    for seen in views.values():
        for k in np.flatnonzero(may_be_person(seen)):
            middle = seen.clusters.middle[k, :2]
            away = (
                abs(middle[0]) + 0.3 * abs(middle[1])
                if centre is None
                else float(np.hypot(*(middle - centre)))
            )
            found.append((away, -float(seen.clusters.area[k]), middle))
    found.sort(key=lambda item: item[:2])
    out: list[Array] = []
    for _, _, middle in found:
        if all(np.hypot(*(middle - other)) > _BESIDE_M for other in out):
            out.append(middle)
    return out


def at_place(seen: ImageClusters, place: Array) -> NDArray[np.bool_]:
    """Return the clusters of a person at x, y, shape (cluster_count,)."""
    k = seen.clusters
    person = may_be_person(seen) & (np.hypot(*(k.middle[:, :2] - place).T) < _BESIDE_M)
    if not person.any():
        return person
    low, high = k.low[person].min(axis=0) - 0.12, k.high[person].max(axis=0) + 0.12
    small = (k.area < 0.25) & (np.hypot(*(k.middle[:, :2] - place).T) < 0.9)
    return person | (small & (k.middle > low).all(axis=1) & (k.middle < high).all(axis=1))


class Nearness(NamedTuple):
    """Nearness of an image's clusters to an expected body.

    Attributes:
        share: share of each cluster's points near the body, limb: whether the cluster is small and may be a limb that
            the image cuts off, shape (cluster_count,).
    """

    share: Array
    limb: NDArray[np.bool_]

    def alone(self) -> NDArray[np.bool_]:
        """Return the clusters of a body with no others near it, shape (cluster_count,)."""
        return (self.share >= _NEAR_SHARE) | self.limb

    def touched(self) -> NDArray[np.bool_]:
        """Return the clusters that may contain a part of the body, shape (cluster_count,)."""
        return (self.share >= _TOUCHED_SHARE) | self.limb

    def aside_m2(self, seen: ImageClusters) -> Array:
        """Return the area of each cluster that is not near the body [m2], shape (cluster_count,)."""
        return (1.0 - self.share) * seen.clusters.area


def near_body(
    seen: ImageClusters,
    fitter: Fitter,
    figure: BodyShape,
    pose: Pose,
    eye: Array,
    *,
    looked_at: int = LOOKED_AT,
    reach_m: float = _REACH_M,
) -> Nearness:
    """Return the nearness of the clusters to the body's prediction.

    Args:
        eye: the camera in the working frame [m], shape (3,).
        looked_at: minimum number of points of each cluster that are tested.
        reach_m: clusters whose middle is farther away are not tested [m].
    """
    count = len(seen.clusters.count)
    near = Nearness(np.zeros(count), np.zeros(count, dtype=bool))
    reach = np.hypot(*(seen.clusters.middle[:, :2] - pose.root[:2]).T) < reach_m
    steps = np.where(reach, np.maximum(seen.clusters.count // looked_at, 1), 0)
    places, owners = _some_of_each(seen.points, seen.clusters.labels, steps)
    if not len(places):
        return near
    views = eye - places
    views /= np.linalg.norm(views, axis=1, keepdims=True)
    points = MeasuredPoints(places, views, np.zeros_like(places), np.zeros(len(places), dtype=np.int64))
    *_, distance = fitter.match(figure, pose, points)
    least = distance.min(axis=1)
    chest = fitter.place(figure, pose)[0][_CHEST]
    for k in np.unique(owners):
        near.share[k] = (least[owners == k] < _NEAR_M).mean()
        if seen.clusters.area[k] < _LIMB_AREA_M2:  # perhaps an arm that the body's image cuts off
            near.limb[k] = np.linalg.norm(seen.clusters.middle[k] - chest) < _LIMB_REACH_M
    return near


@compiled
def _some_of_each(points, labels, steps):
    """Return every `steps[k]`-th point of each cluster k (none if that is 0), and the cluster of each."""
    rows, columns = labels.shape
    seen = np.zeros(len(steps), np.int64)
    places = np.empty((rows * columns, 3))
    owners = np.empty(rows * columns, np.int64)
    count = 0
    for i in range(rows):
        for j in range(columns):
            k = labels[i, j]
            if k < 0 or steps[k] == 0:
                continue
            if seen[k] % steps[k] == 0:
                places[count] = points[i, j]
                owners[count] = k
                count += 1
            seen[k] += 1
    return places[:count].copy(), owners[:count].copy()
