"""Choice of the person to track, where another program found several."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studio.take.importers.keypoints.points import Detections

_LOST_FRAMES = 60
_REACH = 0.4
"""Maximum movement of a person between pictures, as a share of the person's height in the picture."""
_FURTHER = 0.03
"""The same for each picture in which the person was not found."""
_LARGEST_REACH = 1.0
_COMPARABLE = 0.7
"""Minimum total of a candidate for the performer, as a share of the largest total."""

Array = NDArray[np.float64]


@dataclass
class _Track:
    """One person through the pictures."""

    people: dict[int, Array] = field(default_factory=dict)
    last: int = 0
    middle: Array = field(default_factory=lambda: np.zeros(2))
    height: float = 1.0
    total: float = 0.0
    from_middle: float = 0.0

    def add(self, number: int, person: Array, centre: Array) -> None:
        self.people[number] = person
        self.last, self.middle, self.height = number, _middle(person), _height(person)
        self.total += self.height
        self.from_middle += float(np.linalg.norm(self.middle - centre))


def follow(found: Detections, size: tuple[int, int]) -> tuple[dict[int, Array], int]:
    """Return the points of one person by picture, and the largest number of people in a picture.

    People are linked to the nearest ones from picture to picture. The person with the largest total height over all
    pictures is tracked; of several with similar totals, the one nearest to the pictures' middle. A lost person may be
    found again nearby, within 60 pictures.

    Args:
        found: in the pictures.
        size: width and height of the pictures [pixels].
    """
    centre = 0.5 * np.array(size, np.float64)
    tracks: list[_Track] = []
    for number in sorted(found.frames):
        left = list(found.frames[number])
        active = [track for track in tracks if number - track.last <= _LOST_FRAMES]
        pairs = sorted(
            (
                (_apart(track, one, number), i, k)
                for i, track in enumerate(active)
                for k, one in enumerate(left)
            ),
        )
        taken: set[int] = set()
        linked: set[int] = set()
        for apart, i, k in pairs:
            if apart <= 1.0 and i not in linked and k not in taken:
                linked.add(i)
                taken.add(k)
                active[i].add(number, left[k], centre)
        for k, one in enumerate(left):
            if k not in taken:
                tracks.append(_Track())
                tracks[-1].add(number, one, centre)
    most = max((len(people) for people in found.frames.values()), default=0)
    if not tracks:
        return {}, most
    largest = max(track.total for track in tracks)
    likely = [track for track in tracks if track.total >= _COMPARABLE * largest]
    return min(likely, key=lambda track: track.from_middle / len(track.people)).people, most


def _apart(track: _Track, person: Array, number: int) -> float:
    """Return a person's distance from the end of a track, relative to the allowed distance."""
    reach = min(_REACH + _FURTHER * (number - track.last - 1), _LARGEST_REACH)
    return float(np.linalg.norm(_middle(person) - track.middle)) / (reach * max(track.height, 1.0))


def _middle(person: Array) -> Array:
    """Return the middle of the points that were found [pixels]."""
    seen = (person[:, 2] > 0) & np.isfinite(person).all(axis=1)
    return np.average(person[seen, :2], axis=0, weights=person[seen, 2]) if seen.any() else np.zeros(2)


def _height(person: Array) -> float:
    seen = (person[:, 2] > 0) & np.isfinite(person).all(axis=1)
    return float(np.ptp(person[seen, :2], axis=0).max()) if seen.any() else 0.0
