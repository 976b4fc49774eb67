"""Hands of a person whose pose is known, picture after picture: 21 landmarks each, from a square at each arm."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.bundle import MODELS, hand_network
from studio.engine.seeing.pictures.network import Network
from studio.engine.seeing.pictures.region import Region

Array = NDArray[np.float64]

HAND_LANDMARKS = 21
LEAST_PIXELS = 60.0
"""Length of the smallest hand that is searched for."""

HAND_MODEL = MODELS / "hand_landmarker.task"
_NAMES = JOINT_SETS["mediapipe"]
_ARMS = np.array(
    [
        [_NAMES.index(f"{side}_{part}") for part in ("elbow", "wrist", "pinky", "index")]
        for side in ("left", "right")
    ]
)
_OF_FOREARM, _OF_PALM = 0.75, 2.0
"""Length of a hand relative to the forearm, and relative to the distance from wrist to knuckles."""

_WIDTH, _AHEAD = 2.2, 0.1
"""Side of the square, and distance of its middle beyond the knuckles, in lengths of the hand."""

_FOLLOWED_WIDTH, _FOLLOWED_AHEAD = 2.0, 0.1
"""The same for a hand found in the last picture, in extents of its landmarks and beyond their middle."""

_LEAST_VISIBLE = 0.5
_LEAST_PRESENT = 0.5
_AWAY = 0.75
"""Maximum distance of a hand's wrist from the arm's wrist, in lengths of the hand."""

_WRIST, _MIDDLE = 0, 9


@dataclass(frozen=True)
class _FoundHand:
    """One hand in a picture: places of its landmarks as in `Region`, shape (21, 2), and the network's certainty."""

    places: Array
    present: float


class HandFinder:
    """Finds the hands of one person in the pictures of one camera, in their order; used by one thread at a time.

    A hand is searched for where it was in the picture before, then in a square at the end of its arm. The arm decides
    whether it is the left hand.

    Args:
        threads: on which the network runs.

    Raises:
        FormatError: the model's file is damaged.
        NotAvailableError: LiteRT is not installed.
    """

    def __init__(self, threads: int = 1) -> None:
        sizes = (HAND_LANDMARKS * 3, 1)
        self._network = Network(hand_network(HAND_MODEL), HAND_MODEL, sizes, threads)
        self._last: list[Region | None] = [None, None]

    def find(
        self, picture: NDArray[np.uint8], pixels: Array, visibility: Array, *, reduced: float = 1.0
    ) -> list[Array | None]:
        """Return the landmarks of the left and the right hand [pixels], shape (21, 2); None = not seen.

        Args:
            picture: RGB, shape (height, width, 3).
            pixels: the person's 33 landmarks in it, shape (33, 2); the centre of the first pixel is at (0, 0).
            visibility: of these, shape (33,).
            reduced: width of one pixel in pixels of the camera's picture, to which `LEAST_PIXELS` refers.
        """
        image, least = Image.fromarray(np.ascontiguousarray(picture)), LEAST_PIXELS / reduced
        return [
            self._hand(image, k, pixels[arm] + 0.5, visibility[arm], least) for k, arm in enumerate(_ARMS)
        ]

    def forget(self) -> None:
        """Forget the last hands, because nobody is in the picture."""
        self._last = [None, None]

    def _hand(
        self, image: Image.Image, side: int, arm: Array, visibility: Array, least: float
    ) -> Array | None:
        last, self._last[side] = self._last[side], None
        length = hand_length(arm)
        square = square_of(arm)
        inside = 0 < square.x < image.width and 0 < square.y < image.height
        if length < least or visibility[1] < _LEAST_VISIBLE or not inside:
            return None
        wrist = arm[1]
        for region in (last, square):
            if region is None:
                continue
            found = self._read(image, region)
            near = float(np.hypot(*(found.places[_WRIST] - wrist))) < _AWAY * length
            if found.present >= _LEAST_PRESENT and near:
                self._last[side] = followed(found.places)
                return found.places - 0.5
        return None

    def _read(self, image: Image.Image, region: Region) -> _FoundHand:
        side = self._network.side
        values, present = self._network(region.cut(image, side).astype(np.float32) / np.float32(255.0))
        points = values.reshape(HAND_LANDMARKS, 3)[:, :2].astype(np.float64) / side
        return _FoundHand(region.placed(points), float(present.ravel()[0]))


def hand_length(arm: Array) -> float:
    """Return the length of the hand at an arm [pixels].

    Args:
        arm: elbow, wrist, and knuckles of little and index finger, shape (4, 2).
    """
    elbow, wrist, little, index = arm
    palm = 0.5 * (little + index) - wrist
    return max(_OF_FOREARM * float(np.hypot(*(wrist - elbow))), _OF_PALM * float(np.hypot(*palm)))


def square_of(arm: Array) -> Region:
    """Return the square around the hand at an arm, its fingers upwards; `arm`: see `hand_length`."""
    elbow, wrist, little, index = arm
    length = hand_length(arm)
    knuckles = 0.5 * (little + index)
    along = _unit(wrist - elbow) + _unit(knuckles - wrist)
    along = _unit(along)
    middle = knuckles + _AHEAD * length * along
    return Region(float(middle[0]), float(middle[1]), _WIDTH * length, _upwards(along))


def followed(places: Array) -> Region:
    """Return the square for the next picture around a hand with known landmarks, shape (21, 2)."""
    along = _unit(places[_MIDDLE] - places[_WRIST])
    across = np.array([-along[1], along[0]])
    extents = np.stack([places @ across, places @ along], axis=1)
    low, high = extents.min(axis=0), extents.max(axis=0)
    size = float((high - low).max())
    middle = 0.5 * (low + high) + (0.0, _FOLLOWED_AHEAD * size)
    x, y = (middle[0] * across + middle[1] * along).tolist()
    return Region(x, y, _FOLLOWED_WIDTH * size, _upwards(along))


def _unit(vector: Array) -> Array:
    return vector / max(float(np.hypot(*vector)), 1e-9)


def _upwards(along: Array) -> float:
    """Return the angle of the square whose upper side points in a direction [rad]."""
    return math.atan2(float(along[0]), float(-along[1]))
