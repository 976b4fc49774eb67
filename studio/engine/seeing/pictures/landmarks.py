"""The network of landmarks: 33 points of one person in a square cut out of a picture."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from studio.engine.seeing.pictures.network import Network
from studio.engine.seeing.pictures.region import Region

LANDMARKS = 33
_POINTS, _MAP = 39, 64
_MIDDLE, _END = 33, 34
"""The two further points that give the square of the next picture."""

_REACH = 3
_LEAST_SURE = 0.5


@dataclass(frozen=True)
class RegionPose:
    """The network's result for one square.

    Attributes:
        present: certainty that a person is there, 0..1.
        places: of the landmarks in the picture, as in `Region`, shape (33, 2).
        visibility: certainty that each is visible, 0..1, shape (33,).
        presence: certainty that each is within the picture, 0..1, shape (33,).
        world_m: relative to the middle of the hips [m], axes right, down and away of the picture, shape (33, 3).
        next_region: the person's square in the next picture.
    """

    present: float
    places: NDArray[np.float64]
    visibility: NDArray[np.float64]
    presence: NDArray[np.float64]
    world_m: NDArray[np.float64]
    next_region: Region


class LandmarkNetwork:
    """Finds the landmarks of a person.

    Args:
        content: the network's file.
        path: where it came from, for errors.
        threads: number on which it runs.

    Raises:
        FormatError, NotAvailableError: as for `Network`.
    """

    def __init__(self, content: bytes, path: Path, threads: int = 1) -> None:
        sizes = (_POINTS * 5, 1, _POINTS * _MAP * _MAP, _POINTS * 3)
        self._network = Network(content, path, sizes, threads)

    def read(self, picture: Image.Image, region: Region) -> RegionPose:
        """Return the landmarks in a square of an RGB picture."""
        side = self._network.side
        image = region.cut(picture, side).astype(np.float32) / np.float32(255.0)
        values, present, maps, world = self._network(image)
        rows = values.reshape(_POINTS, 5).astype(np.float64)
        points = _refined(rows[:, :2] / side, maps.reshape(_MAP, _MAP, _POINTS))
        places = region.placed(points)
        metres = world.reshape(_POINTS, 3)[:LANDMARKS].astype(np.float64)
        metres[:, :2] = metres[:, :2] @ region.turn().T
        sure = _sigmoid(rows[:LANDMARKS, 3:])
        return RegionPose(
            present=float(present.ravel()[0]),
            places=places[:LANDMARKS],
            visibility=sure[:, 0],
            presence=sure[:, 1],
            world_m=metres,
            next_region=Region.about(places[_MIDDLE], places[_END]),
        )


def _refined(points: NDArray[np.float64], maps: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return points moved to the centre of their map's values around them, where the map is certain.

    Args:
        points: 0..1, shape (n, 2).
        maps: of each point, as logits, shape (rows, columns, n).
    """
    size = maps.shape[0]
    cells = np.floor(points * size)
    steps = np.arange(-_REACH, _REACH + 1)
    columns = cells[:, 0, None] + steps
    rows = cells[:, 1, None] + steps
    inside = ((rows >= 0) & (rows < size))[:, :, None] & ((columns >= 0) & (columns < size))[:, None, :]
    at_rows = np.clip(rows, 0, size - 1).astype(np.intp)[:, :, None]
    at_columns = np.clip(columns, 0, size - 1).astype(np.intp)[:, None, :]
    weights = _sigmoid(maps[at_rows, at_columns, np.arange(len(points))[:, None, None]]) * inside
    total = weights.sum(axis=(1, 2))
    mean_x = (weights.sum(axis=1) * columns).sum(axis=1) / np.maximum(total, 1e-9)
    mean_y = (weights.sum(axis=2) * rows).sum(axis=1) / np.maximum(total, 1e-9)
    within = ((cells >= 0) & (cells < size)).all(axis=1)
    moved = within & (weights.max(axis=(1, 2)) >= _LEAST_SURE)
    return np.where(moved[:, None], np.stack([mean_x, mean_y], axis=1) / size, points)


def _sigmoid(values: NDArray[np.floating]) -> NDArray[np.float64]:
    return 1.0 / (1.0 + np.exp(-np.clip(values.astype(np.float64), -60.0, 60.0)))
