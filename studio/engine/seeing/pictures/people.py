"""The detector of people: where they are, and how they are turned.

A single-shot detector (SSD): for each of its anchors it gives the certainty of a person, a box around the face and
four points. The first point is the middle of the hips, the second is on the circle around the whole person.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from studio.engine.seeing.pictures.network import Network
from studio.engine.seeing.pictures.region import Region

_ROWS = ((8, 2), (16, 2), (32, 6))
"""Distance of anchors [pixels], and their number at each place."""

_VALUES = 12
_LEAST_SURE = 0.5
_SAME_OVERLAP = 0.3
_LARGEST_SCORE = 100.0


@dataclass(frozen=True)
class Person:
    """A person in a picture.

    Attributes:
        region: the square around the whole person.
        sure: certainty, 0..1.
    """

    region: Region
    sure: float


class PeopleDetector:
    """Finds people in pictures.

    Args:
        content: the network's file.
        path: where it came from, for errors.
        threads: number on which it runs.

    Raises:
        FormatError, NotAvailableError: as for `Network`.
    """

    def __init__(self, content: bytes, path: Path, threads: int = 1) -> None:
        count = len(_anchors(224))
        self._network = Network(content, path, (count * _VALUES, count), threads)
        self._anchors = _anchors(self._network.side)

    def people(self, picture: Image.Image) -> list[Person]:
        """Return the people in an RGB picture, the most certain first."""
        side = self._network.side
        whole = Region.whole(*picture.size)
        image = whole.cut(picture, side).astype(np.float32) / np.float32(127.5) - np.float32(1.0)
        values, scores = self._network(image)
        sure = 1.0 / (
            1.0 + np.exp(-np.clip(scores.ravel().astype(np.float64), -_LARGEST_SCORE, _LARGEST_SCORE))
        )
        some = np.flatnonzero(sure >= _LEAST_SURE)
        some = some[np.argsort(-sure[some], kind="stable")]
        rows = values.reshape(-1, _VALUES)[some].astype(np.float64) / side
        middles = self._anchors[some] + rows[:, :2]
        boxes = np.concatenate([middles - 0.5 * rows[:, 2:4], middles + 0.5 * rows[:, 2:4]], axis=1)
        points = rows[:, 4:8].reshape(-1, 2, 2) + self._anchors[some][:, None]
        return [
            Person(
                Region.about(*whole.placed(np.average(points[same], axis=0, weights=sure[some][same]))), best
            )
            for same, best in _groups(boxes, sure[some])
        ]


def _groups(boxes: NDArray[np.float64], sure: NDArray[np.float64]) -> list[tuple[NDArray[np.intp], float]]:
    """Return the rows of each person, and their best certainty.

    Args:
        boxes: left, top, right, bottom, shape (n, 4), the most certain first.
        sure: certainty, shape (n,).
    """
    left = np.arange(len(boxes))
    groups = []
    while len(left):
        same = _overlap(boxes[left[0]], boxes[left]) > _SAME_OVERLAP
        same[0] = True
        groups.append((left[same], float(sure[left[0]])))
        left = left[~same]
    return groups


def _overlap(box: NDArray[np.float64], boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return intersection over union of a box with each of the others, shape (n,)."""
    common = np.minimum(box[2:], boxes[:, 2:]) - np.maximum(box[:2], boxes[:, :2])
    both = np.prod(np.maximum(common, 0.0), axis=1)
    areas = np.prod(np.maximum(boxes[:, 2:] - boxes[:, :2], 0.0), axis=1)
    own = float(np.prod(np.maximum(box[2:] - box[:2], 0.0)))
    return both / np.maximum(areas + own - both, 1e-9)


def _anchors(side: int) -> NDArray[np.float64]:
    """Return the anchors of an image, 0..1, shape (n, 2)."""
    parts = []
    for distance, count in _ROWS:
        places = (np.arange(side // distance) + 0.5) * distance / side
        y, x = np.meshgrid(places, places, indexing="ij")
        parts.append(np.repeat(np.stack([x.ravel(), y.ravel()], axis=1), count, axis=0))
    return np.concatenate(parts)
