"""A tracker's result for the images of one instant."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studio.engine.seeing.fitting.chain import Pose
from studio.engine.seeing.fitting.fit import BodyShape, MeasuredPoints

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrackedSkeleton:
    """One skeleton, and the others of its instant.

    Attributes:
        time_ns: its instant on the cameras' common clock.
        positions: canonical joints [m], shape (21, 3), in the stage frame, or the camera's own if the tracker has
            no transforms; NaN = nobody is tracked.
        confidence: shape (21,), 0..1.
        status: `tracked`, `searching` (nobody yet) or `lost`.
        legs_unread: by camera, why it has not shown the legs below the knees for half a second: `range`,
            `no_depth`, `covered` or `outside`.
        body: the tracker's number of the body. others: further bodies tracked at this instant.
    """

    time_ns: int
    positions: Array
    confidence: Array
    status: str
    legs_unread: Mapping[str, str] = field(default_factory=dict)
    body: int = 0
    others: "tuple[TrackedSkeleton, ...]" = ()

    def each(self) -> "tuple[TrackedSkeleton, ...]":
        """Return this skeleton and the others."""
        return (self, *self.others)


@dataclass(frozen=True)
class OnBody:
    """Points of one instant and their places on the fitted body, in the working frame.

    Attributes:
        points, places, normals: measured points, nearest places on the surface, outward normals there [m], each of
            shape (point_count, 3). distance: between them [m], camera: index of the image, shape (point_count,).
    """

    points: Array
    places: Array
    normals: Array
    distance: Array
    camera: NDArray[np.int64]


@dataclass(frozen=True)
class FittedBody:
    """A body at one instant, and the points to which it was fitted; `points.camera` is the index of the image."""

    figure: BodyShape
    pose: Pose
    points: MeasuredPoints
