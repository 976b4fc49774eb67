"""Where a camera client's frames come from: the registry of sources and what a source is.

simulated:<index>/<count>[:<seed>]    a camera of a standard rig that watches the embedded performer
recording:<path>[#<camera>]           a take or a recording that `studio import` reads, in real time, over
                                      and over; recording:<path>[#<camera>]?speed=max once, as fast as it goes
"""

from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from studio.engine.errors import NotAvailableError, SettingsError
from studio.wire import HandState


@dataclass(frozen=True)
class SourceFrame:
    """One skeleton of a source.

    Attributes:
        device_time_ns: capture time on the source's own clock [ns].
        positions: device joints in the camera frame [m], shape (joint_count, 3); NaN = unseen.
        confidence: shape (joint_count,), 0..1.
        hands: hand states, where the source knows them.
        head_wxyz: head orientation in the camera frame, where measured.
    """

    device_time_ns: int
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    hands: tuple[HandState, ...] = ()
    head_wxyz: tuple[float, float, float, float] | None = None


class Source(Protocol):
    """A camera: what it is, its clock, and its frames.

    Attributes:
        name: the camera's name where the user gives none.
        device: what it is, for people.
        joint_set: a name of `joints.JOINT_SETS`.
        frames_per_second: nominal.
        realtime: frames come at their own pace and an old one may be dropped; False = wait for the link.
    """

    name: str
    device: str
    joint_set: str
    frames_per_second: float
    realtime: bool

    def clock_ns(self) -> int:
        """Return the clock that stamps the frames, now [ns]."""

    def frames(self) -> AsyncIterator[SourceFrame]:
        """Yield frames as they come; ends where the source does."""


def _open_simulated(argument: str) -> Source:
    from studio.camera.simulator.live import open_simulated

    return open_simulated(argument)


def _open_recording(argument: str) -> Source:
    from studio.camera.recording_source import open_recording

    return open_recording(argument)


SOURCES: dict[str, Callable[[str], Source]] = {"simulated": _open_simulated, "recording": _open_recording}
"""Kind of source -> what opens it; a device's library is imported only then."""

LATER = ("azure-kinect", "kinect-v1", "kinect-v2", "realsense", "orbbec", "mediapipe", "openni", "depth")


def open_source(text: str) -> Source:
    """Return the source that `text` names, `<kind>:<argument>`.

    Raises:
        SettingsError: an unknown kind, or an argument that its kind does not allow.
        NotAvailableError: a kind of source that this version does not have.
        FormatError, TakeError: a recording that cannot be read.
    """
    kind, _, argument = text.partition(":")
    if kind in LATER:
        raise NotAvailableError(
            f"source {kind} is not available in this version; available: {', '.join(SOURCES)}"
        )
    if kind not in SOURCES:
        raise SettingsError(
            f"unknown source {text!r}; allowed: simulated:<index>/<count>[:<seed>], such as simulated:0/2, "
            "or recording:<path>[#<camera>]"
        )
    return SOURCES[kind](argument)
