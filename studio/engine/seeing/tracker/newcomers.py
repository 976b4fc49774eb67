"""Detection of people who come in while others are followed: unexplained clusters, as high as a person, that stay."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.seeing.bodies.cells import PlacedBodies, cells_of, distances_of
from studio.engine.seeing.bodies.columns import apart
from studio.engine.seeing.images.clusters import Clusters, clusters_of
from studio.engine.seeing.tracker.person import candidates, may_be_person
from studio.engine.seeing.tracker.shares import Share
from studio.engine.seeing.tracker.view import LEAST_CELLS, MOST_CLUSTERS, CameraView, ImageClusters

Array = NDArray[np.float64]

_EVERY = 3
"""Frames between two looks."""
_LOOKS = 4
"""Number of successive looks that must show a person before they count as new."""
_NEAR_M = 0.4
"""Largest distance of a person from where the last look saw them [m]."""
_ASIDE_M2 = 0.12
"""A cluster may show somebody else if its body leaves more than this area unexplained [m2]."""
_APART_M = 0.25
"""Distance from every body above which points belong to none [m]."""
_REST = 30
"""Looks before a place where nobody was found is tried again; doubles each time."""


@dataclass
class _Refused:
    """A place where nobody was found: remaining and total number of looks before it is tried again."""

    place: Array
    left: int
    wait: int


class Newcomers:
    """Places where somebody may have come in, and for how long."""

    def __init__(self) -> None:
        self._frame = 0
        self._waiting: list[tuple[Array, int]] = []
        self._refused: list[_Refused] = []

    def looks(self, seen: Mapping[str, ImageClusters], shares: Sequence[Share]) -> bool:
        """Whether to look in this frame; images that show only the bodies need no look."""
        self._frame += 1
        if self._frame % _EVERY:
            return False
        for one in self._refused:
            one.left = max(one.left - 1, 0)
        for name, view in seen.items():
            taken = np.any([share.chosen[name] for share in shares], axis=0)
            aside = np.min([share.aside_m2[name] for share in shares], axis=0)
            free = view.clusters.middle[may_be_person(view) & ~taken, :2]
            if (taken & (aside > _ASIDE_M2)).any() or not all(self._is_refused(place) for place in free):
                return True
        self._waiting = []
        return False

    def places(self, rest: dict[str, ImageClusters], *, awaited: bool) -> list[Array]:
        """Return where people have stayed for some looks, x and y [m].

        Args:
            rest: clusters that no body explains, by camera.
            awaited: whether somebody is lost; then one look is enough.
        """
        before = self._waiting
        self._waiting = [
            (place, 1 + max((looks for other, looks in before if _near(place, other)), default=0))
            for place in candidates(rest, np.zeros(2))
            if not self._is_refused(place)
        ]
        return [place for place, looks in self._waiting if looks >= (1 if awaited else _LOOKS)]

    def refuse(self, place: Array) -> None:
        """Register that nobody is at a place, which is then not tried for some time."""
        for one in self._refused:
            if _near(place, one.place):
                one.wait = 2 * one.wait
                one.left = one.wait
                return
        self._refused.append(_Refused(place, _REST, _REST))

    def _is_refused(self, place: Array) -> bool:
        return any(one.left > 0 and _near(place, one.place) for one in self._refused)


def _near(place: Array, other: Array) -> bool:
    return float(np.hypot(*(place - other))) < _NEAR_M


def rest_of(
    views: Mapping[str, CameraView],
    seen: Mapping[str, ImageClusters],
    shares: Sequence[Share],
    placed: PlacedBodies,
) -> dict[str, ImageClusters]:
    """Return the clusters that no body explains, by camera, each person in their own cluster."""
    rest = {}
    for name, view in seen.items():
        labels = view.clusters.labels
        taken = np.any([share.chosen[name] for share in shares], axis=0)
        use = np.append(~taken, False)[labels]
        cells = cells_of(labels, taken)
        away = distances_of(view.points, cells, placed).min(axis=1) > _APART_M
        use[cells[away, 0], cells[away, 1]] = True
        found = clusters_of(view.points, view.depth, use, views[name].cell_angle, LEAST_CELLS, MOST_CLUSTERS)
        rest[name] = parted(views[name], ImageClusters(view.points, view.depth, view.keep, Clusters(*found)))
    return rest


def parted(view: CameraView, seen: ImageClusters) -> ImageClusters:
    """Return an image's clusters, with each cluster of several people split."""
    clusters = apart(seen.points, seen.depth, seen.clusters, view.cell_angle)
    return seen if clusters is seen.clusters else ImageClusters(seen.points, seen.depth, seen.keep, clusters)
