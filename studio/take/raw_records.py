"""What `raw.mcap` holds, record by record, and the step from a device's joints to the canonical ones."""

from dataclasses import dataclass
from typing import Any

from studio import wire
from studio.engine.frames import CameraFrame, HandSeen
from studio.engine.joints import to_canonical

LIVE_TOPIC = "live"
PROFILE = "capture-studio"


@dataclass(frozen=True)
class RawCamera:
    """A camera joined (or joined again, with another `boot_id`); its frames follow."""

    hello: wire.Hello


@dataclass(frozen=True)
class RawFrame:
    """A frame as it came: camera, arrival [ns], the wire message, and its canonical form."""

    camera: str
    arrival_ns: int
    message: wire.SkeletonFrame
    frame: CameraFrame


@dataclass(frozen=True)
class RawEvent:
    """An event of the live log."""

    time_ns: int
    event: dict[str, Any]


RawRecord = RawCamera | RawFrame | RawEvent


def camera_topic(name: str) -> str:
    """Return the MCAP topic of a camera's skeletons."""
    return f"camera/{name}/skeleton"


def camera_frame(camera: str, joint_set: str, message: wire.SkeletonFrame) -> CameraFrame:
    """Return a frame in canonical joints: the one place where device joints become canonical.

    Raises:
        FormatError: an unknown joint set, or a frame that does not fit it.
    """
    positions, confidence = to_canonical(joint_set, *wire.joint_arrays(message, joint_set))
    return CameraFrame(
        camera=camera,
        sequence=message.sequence,
        device_time_ns=message.device_time_ns,
        positions=positions,
        confidence=confidence,
        hands=tuple(HandSeen(hand.side, hand.method, hand.open_probability) for hand in message.hands),
        head_wxyz=message.head_wxyz,
    )
