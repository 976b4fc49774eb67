"""Where a camera client's frames come from: what a source is, and the registry of sources.

`open_source` says in its errors which there are; `studio camera --help` and docs/devices.md describe them. A source
that gives depth (`depth_source.DepthSource`) becomes one of skeletons through `tracked.TrackedSource`.
"""

from collections.abc import AsyncIterator
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from studio.engine.errors import SettingsError
from studio.wire import HandState, Intrinsics


@dataclass(frozen=True)
class SourceFrame:
    """One skeleton of a source.

    Attributes:
        device_time_ns: capture time on the source's own clock [ns].
        positions: device joints in the camera frame [m], shape (joint_count, 3); NaN = unseen.
        confidence: shape (joint_count,), 0..1.
        hands: hand states, where the source knows them.
        head_wxyz: head orientation in the camera frame, where measured.
        depth_mm: the image that it was made from, where it is to be recorded, shape (height, width).
    """

    device_time_ns: int
    positions: NDArray[np.float64]
    confidence: NDArray[np.float64]
    hands: tuple[HandState, ...] = ()
    head_wxyz: tuple[float, float, float, float] | None = None
    depth_mm: NDArray[np.uint16] | None = None


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


@dataclass(frozen=True)
class Kind:
    """A kind of source.

    Attributes:
        module, function: what opens it from the text after the colon; the module, with its device's library, is
            imported only then.
        argument: how that text is written; "" = there is none.
        device: it is a device, which may be unplugged and come back.
    """

    module: str
    function: str
    argument: str
    device: bool = False


_DEVICES = "studio.camera.devices"

SOURCES: dict[str, Kind] = {
    "simulated": Kind("studio.camera.simulator.live", "open_simulated", "<index>/<count>[:<seed>]"),
    "simulated-depth": Kind(
        "studio.camera.simulator.depth.source", "open_simulated_depth", "<index>/<count>[:<seed>]"
    ),
    "recording": Kind("studio.camera.recording_source", "open_recording", "<path>[#<camera>][?speed=max]"),
    "realsense": Kind(f"{_DEVICES}.realsense", "open_realsense", "[<serial>]", device=True),
    "orbbec": Kind(f"{_DEVICES}.orbbec", "open_orbbec", "[<serial>]", device=True),
    "openni": Kind(f"{_DEVICES}.openni", "open_openni", "[<number>]", device=True),
    "azure-kinect": Kind(f"{_DEVICES}.azure_kinect", "open_azure_kinect", "[<number>][?bodies]", device=True),
    "kinect-v2": Kind(f"{_DEVICES}.kinect_v2", "open_kinect_v2", "[?bodies]", device=True),
    "webcam": Kind(f"{_DEVICES}.webcam", "open_webcam", "<model file>[#<number>]", device=True),
}
"""The kinds of sources by name, `<kind>[:<argument>]`."""


def open_source(text: str, *, keep_depth: bool = False) -> Source:
    """Return the source that `text` names, `<kind>[:<argument>]`.

    Args:
        text: see `SOURCES`.
        keep_depth: frames made from depth carry their image.

    Raises:
        SettingsError: an unknown kind, or an argument that its kind does not allow.
        NotAvailableError: a device whose library is not installed.
        StudioError: a device that is not there. FormatError, TakeError: a recording that cannot be read.
    """
    name, _, argument = text.partition(":")
    if "?" in name:  # a flag without a device, such as kinect-v2?bodies
        name, _, flags = name.partition("?")
        argument = f"?{flags}"
    kind = SOURCES.get(name)
    if kind is None:
        allowed = ", ".join(written(name) for name in SOURCES)
        raise SettingsError(f"unknown source {text!r}; allowed: {allowed}, such as simulated:0/2")
    opener = getattr(import_module(kind.module), kind.function)
    if kind.device:
        from studio.camera.depth_source import SteadySource

        opened: Any = SteadySource(lambda: opener(argument))
    else:
        opened = opener(argument)
    if getattr(opened, "camera", None) is None:
        return opened
    from studio.camera.tracked import TrackedSource

    return TrackedSource(opened, keep_depth=keep_depth)


def written(name: str) -> str:
    """Return how a kind of source is written, such as `simulated:<index>/<count>[:<seed>]`."""
    argument = SOURCES[name].argument
    if not argument.startswith("["):
        return f"{name}:{argument}"
    return f"{name}[:{argument[1:]}" if argument.startswith("[<") else f"{name}{argument}"


def serial_of_source(source: Any) -> str:
    """Return the serial number of a source's device, "" where it has none."""
    return str(getattr(source, "serial", ""))


def tracked_ns_of_source(source: Any) -> int:
    """Return how long a source's tracker has been busy in all [ns]; 0 where it has none."""
    return int(getattr(source, "tracked_ns", 0))


def newest_depth(source: Any) -> tuple[int, NDArray[np.uint16]] | None:
    """Return the newest depth image that a source made a skeleton of, with its time; None where there is none."""
    latest = getattr(source, "latest", None)
    return None if latest is None else (latest[1].time_ns, latest[0])


def intrinsics_of_source(source: Any) -> Intrinsics | None:
    """Return the depth camera's intrinsics of a source that is made from depth, else None."""
    return getattr(source, "intrinsics", None)
