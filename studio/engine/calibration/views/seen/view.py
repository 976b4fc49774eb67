"""One ordinary camera's observations of a performer: landmarks in its pictures, by frame."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.lens import Lens
from studio.engine.model.joints import INDEX, MIRROR

JOINTS: tuple[str, ...] = (
    "head",
    *(f"{side}_{name}" for side in ("left", "right")
      for name in ("shoulder", "elbow", "wrist", "hand", "hip", "knee", "ankle", "toe")),
)  # fmt: skip
"""The canonical joints that are used: those that pose networks give directly. Hips and neck are only middles of other
joints; spine and chest are not given at all."""
COLUMNS: NDArray[np.int64] = np.array([INDEX[name] for name in JOINTS])
"""Their indices among the canonical joints."""
NUMBER: dict[str, int] = {name: i for i, name in enumerate(JOINTS)}
OTHER_SIDE: NDArray[np.int64] = np.array([list(COLUMNS).index(MIRROR[j]) for j in COLUMNS])
"""Indices among `JOINTS` after an exchange of left and right."""


@dataclass(frozen=True)
class View:
    """Landmarks of one camera.

    Attributes:
        name: the camera's.
        time_s: time of each frame on the camera's own clock [s], increasing, shape (frame_count,).
        pixels: canonical joints in the picture [pixel], x to the right, y down, shape (frame_count, 21, 2);
            NaN = unseen.
        confidence: 0..1, shape (frame_count, 21).
        world_m: the pose network's own guess of the joints relative to the middle of the hips [m], along the
            picture's axes (x right, y down, z away), shape (frame_count, 21, 3); NaN = unseen.
        width, height: of the picture [pixel].
        lens: of the camera; None = its focal length is unknown.
        focal_share: relative deviation of its focal length from that of `lens`; 0 = exact.
        clock_within_s: largest deviation from a clock shared with other views that have this [s]; None = unknown.
    """

    name: str
    time_s: NDArray[np.float64]
    pixels: NDArray[np.float64]
    confidence: NDArray[np.float64]
    world_m: NDArray[np.float64]
    width: int
    height: int
    lens: Lens | None = None
    focal_share: float = 0.0
    clock_within_s: float | None = None

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Return whether a joint has a finite place in the picture and some confidence, shape (frame_count, 21)."""
        with np.errstate(invalid="ignore"):
            inside = (self.pixels >= 0).all(axis=2) & (self.pixels <= [self.width, self.height]).all(axis=2)
        return inside & (self.confidence > _LEAST_CONFIDENCE) & np.isfinite(self.world_m).all(axis=2)


_LEAST_CONFIDENCE = 0.2
