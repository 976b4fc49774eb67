"""A camera client's result for one depth image (step 1)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import HandSeen


@dataclass(frozen=True)
class Observation:
    """The result for one image, in the camera frame.

    Attributes:
        time_ns: of the image, on the camera's clock.
        positions: canonical joints [m], shape (21, 3); NaN = unseen.
        confidence: shape (21,), 0..1.
        hands: states of the hands, by both methods.
        head_wxyz: the head's rotation from the T-pose, in which it faces -y with z up; None = not measured.
        status: the tracker's: `tracked`, `searching` or `lost`.
        problem: parts of the performer that the camera cannot see, as text for people; "" = none.
        body: the tracker's number of the body. others: further bodies in the image.
    """

    time_ns: int
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    hands: tuple[HandSeen, ...] = ()
    head_wxyz: tuple[float, float, float, float] | None = None
    status: str = "tracked"
    problem: str = ""
    body: int = 0
    others: "tuple[Observation, ...]" = ()

    def each(self) -> "tuple[Observation, ...]":
        """Return this observation and the others."""
        return (self, *self.others)
