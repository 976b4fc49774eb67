"""The pose of one person, picture after picture."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_value
from studio.engine.seeing.pictures.bundle import model_file, pose_networks
from studio.engine.seeing.pictures.described import is_description
from studio.engine.seeing.pictures.landmarks import LandmarkNetwork, RegionPose
from studio.engine.seeing.pictures.onnx_poses import DescribedNetwork, PersonBox
from studio.engine.seeing.pictures.people import PeopleDetector, Person
from studio.engine.seeing.pictures.region import Region

WORKING_SIDE = 960
"""Target length of the longer side to which larger pictures are reduced, without loss for the landmarks."""

_LEAST_PRESENT = 0.5
_LOOK_ABOUT = 60
"""Number of pictures between two counts of people while the person is followed."""

_COMPARABLE = 0.6
"""Minimum size, relative to the largest person, of people who count as equally near to the camera."""


@dataclass(frozen=True)
class FoundPose:
    """The pose of a person in one picture.

    Attributes:
        pixels: the 33 landmarks of BlazePose, shape (33, 2); the centre of the first pixel is at (0, 0).
            They may be outside the picture.
        visibility: certainty that each is visible, 0..1, shape (33,).
        presence: certainty that each is within the picture, 0..1, shape (33,).
        world_m: relative to the middle of the hips, axes of the camera (right, down, away) [m], shape (33, 3).
        people: number of people in the picture, as last counted.
    """

    pixels: NDArray[np.float64]
    visibility: NDArray[np.float64]
    presence: NDArray[np.float64]
    world_m: NDArray[np.float64]
    people: int = 1


class PoseFinder:
    """Finds the pose of one person in the pictures of one camera, in their order; used by one thread at a time.

    The detector looks for people at the start and when the person is lost. Of the people about as large as the
    largest, the one nearest to the picture's middle is chosen, and then followed.

    A third-party network gives the landmarks that it has. The other landmarks, and the 3D pose, are those of `full`.

    Args:
        model: `lite`, `full` or `heavy`, or a file, see `model_file`; a description means a third-party network.
        threads: number on which the networks run.

    Raises:
        SettingsError: no such model.
        FormatError: a file that is no model.
        NotAvailableError: the model or LiteRT is not installed.
    """

    def __init__(self, model: str | Path = "full", threads: int = 1) -> None:
        path = model_file(model)
        self._other = DescribedNetwork(path, threads) if is_description(path) else None
        path = path if self._other is None else model_file("full")
        detector, landmarks = pose_networks(path)
        self._detector = PeopleDetector(detector, path, threads)
        self._landmarks = LandmarkNetwork(landmarks, path, threads)
        self._region: Region | None = None
        self._since_count = 0
        self._people = 0

    def find(self, picture: NDArray[np.uint8]) -> FoundPose | None:
        """Return the pose in a picture; None = nobody is there.

        Args:
            picture: RGB, shape (height, width, 3), any size.

        Raises:
            SettingsError: an array of another shape or type.
        """
        if picture.ndim != 3 or picture.shape[2] != 3 or picture.dtype != np.uint8 or picture.size == 0:
            given = f"{picture.dtype} {picture.shape}"
            raise SettingsError(bad_value("picture", given, "uint8, shape (height, width, 3)"))
        image = Image.fromarray(np.ascontiguousarray(picture))
        factor = max(1, max(image.size) // WORKING_SIDE)
        image = image.reduce(factor) if factor > 1 else image
        seen = self._followed(image) or self._looked_for(image)
        if seen is None:
            self._people = 0
            return None
        self._region = seen.next_region if self._region is None else self._region.towards(seen.next_region)
        places, visibility = self._read_by_other(image, seen)
        return FoundPose(places * factor - 0.5, visibility, seen.presence, seen.world_m, max(self._people, 1))

    def _read_by_other(
        self, image: Image.Image, seen: RegionPose
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return places and visibility of the landmarks, from the third-party network where it has them."""
        if self._other is None:
            return seen.places, seen.visibility
        low, high = seen.places.min(axis=0), seen.places.max(axis=0)
        middle, size = 0.5 * (low + high), high - low
        box = PersonBox(float(middle[0]), float(middle[1]), float(size[0]), float(size[1]))
        places, sure = self._other.read(image, box)
        its = np.isfinite(places[:, 0])
        return np.where(its[:, None], places, seen.places), np.where(its, sure, seen.visibility)

    def _followed(self, image: Image.Image) -> RegionPose | None:
        """Return the landmarks of the person in the last picture; None = lost, or nobody was there."""
        if self._region is None or not self._region.usable(*image.size):
            return None
        seen = self._landmarks.read(image, self._region)
        if seen.present < _LEAST_PRESENT:
            return None
        self._since_count += 1
        if self._since_count >= _LOOK_ABOUT:
            self._count(self._detector.people(image))
        return seen

    def _looked_for(self, image: Image.Image) -> RegionPose | None:
        people = self._detector.people(image)
        self._count(people)
        self._region = None
        if not people:
            return None
        seen = self._landmarks.read(image, nearest(people, *image.size).region)
        return seen if seen.present >= _LEAST_PRESENT else None

    def _count(self, people: list[Person]) -> None:
        self._people, self._since_count = len(people), 0


def nearest(people: list[Person], width: int, height: int) -> Person:
    """Return the person nearest to the middle of a picture, among those about as large as the largest."""
    largest = max(one.region.side for one in people)
    near = [one for one in people if one.region.side >= _COMPARABLE * largest]
    return min(near, key=lambda one: np.hypot(one.region.x - 0.5 * width, one.region.y - 0.5 * height))
