"""The client's cameras: `Source`, of skeletons, and `Camera`, its common base with `DepthSource`."""

from abc import ABC, abstractmethod
from collections.abc import AsyncIterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.wire import HandState, Intrinsics, LandmarkArrays


@dataclass(frozen=True)
class SourceFrame:
    """One skeleton of a source, and the others that it saw at the same moment.

    Attributes:
        device_time_ns: capture time on the source's own clock [ns].
        positions: device joints in the camera frame [m], shape (joint_count, 3); NaN = unseen.
        confidence: shape (joint_count,), 0..1.
        hands: hand states, if the source has them.
        head_wxyz: head orientation in the camera frame, where measured.
        depth_mm: its depth image, if it is to be recorded, shape (height, width).
        picture: the landmarks of a camera without depth, whose `positions` are not sent; `confidence` is how visible
            they are.
        body: the device's own number of the body.
        others: further bodies at the same moment, each with another number, sent without image or landmarks.
    """

    device_time_ns: int
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    hands: tuple[HandState, ...] = ()
    head_wxyz: tuple[float, float, float, float] | None = None
    depth_mm: NDArray[np.uint16] | None = None
    picture: LandmarkArrays | None = None
    body: int = 0
    others: "tuple[SourceFrame, ...]" = ()


class Camera(ABC):
    """Base of every camera. A camera derives from `Source` or `DepthSource`, and sets name and device.

    Attributes:
        name: the camera's default name: letters, digits, `_`, `.`, `-`.
        device: the device, for people.
        serial: the device's serial number; "" = none.
        frames_per_second: nominal.
        realtime: frames come at their own rate and old ones may be dropped; False = wait for the reader.
    """

    name: str
    device: str
    serial: str = ""
    frames_per_second: float = 30.0
    realtime: bool = True

    @property
    def problem(self) -> str:
        """The camera's present problem, for a person; "" = none."""
        return ""

    @abstractmethod
    def clock_ns(self) -> int:
        """Return the present time on the clock that stamps the frames [ns]."""


class Source(Camera):
    """A camera of skeletons.

    Attributes:
        joint_set: a name of `joints.JOINT_SETS`.
        intrinsics: of the depth camera from whose images the skeletons are made; None = none.
    """

    joint_set: str = "canonical"
    intrinsics: Intrinsics | None = None

    @property
    def tracked_ns(self) -> int:
        """Total busy time of a tracker on this machine [ns]; 0 = there is none."""
        return 0

    @property
    def newest_depth(self) -> tuple[int, NDArray[np.uint16]] | None:
        """The newest image from which a skeleton was made: its time [ns], depth [mm], shape (height, width)."""
        return None

    @abstractmethod
    def frames(self) -> AsyncIterator[SourceFrame]:
        """Yield frames as they come; ends with the source."""
