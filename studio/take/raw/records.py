"""The records of `raw.mcap`, and the conversion of a device's joints to the canonical ones."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.engine.model.cameras.depth import DepthCamera, DepthFrame
from studio.engine.model.frames import CameraFrame, HandSeen, PictureJoints
from studio.engine.model.human import face
from studio.engine.model.joints import JOINT_COUNT, to_canonical
from studio.take.raw.live_log import LiveEvent

LIVE_TOPIC = "live"
PROFILE = "capture-studio"
_UNSEEN = np.full((JOINT_COUNT, 3), np.nan)

LATE_KEY = "late"
"""Key of a channel's metadata: its frames arrived after the live solve had passed them."""


@dataclass(frozen=True)
class RawCamera:
    """A camera joined (or joined again, with another `boot_id`); its frames follow."""

    hello: wire.Hello


@dataclass(frozen=True)
class RawFrame:
    """A frame as received: camera, arrival [ns], the wire message, and its canonical form.

    `boot_id` is the start of the client that took it; `late`: it arrived after the live solve had passed it.
    """

    camera: str
    arrival_ns: int
    message: wire.SkeletonFrame
    frame: CameraFrame
    boot_id: str = ""
    late: bool = False


@dataclass(frozen=True)
class RawEvent:
    """An event of the live log."""

    time_ns: int
    event: LiveEvent


@dataclass(frozen=True)
class RawDepth:
    """A depth image as received: camera, arrival [ns], the wire message still packed, and its intrinsics.

    `boot_id` is the start of the client that took it.
    """

    camera: str
    arrival_ns: int
    message: wire.DepthImage
    intrinsics: wire.Intrinsics
    boot_id: str = ""

    def frame(self) -> DepthFrame:
        """Return the image, unpacked.

        Raises:
            FormatError: damaged, or not of the size that the intrinsics give.
        """
        depth_mm = wire.depth_array(self.message, self.intrinsics)
        return DepthFrame(self.camera, self.message.sequence, self.message.device_time_ns, depth_mm)


RawRecord = RawCamera | RawFrame | RawDepth | RawEvent


def camera_topic(name: str) -> str:
    """Return the MCAP topic of a camera's skeletons."""
    return f"camera/{name}/skeleton"


def depth_topic(name: str) -> str:
    """Return the MCAP topic of a camera's depth images."""
    return f"camera/{name}/depth"


def is_depth_topic(topic: str) -> bool:
    """Whether an MCAP topic is that of a camera's depth images."""
    return topic.endswith("/depth")


def depth_camera(intrinsics: wire.Intrinsics) -> DepthCamera:
    """Return the engine's camera of a hello's intrinsics."""
    return DepthCamera(
        intrinsics.fx,
        intrinsics.fy,
        intrinsics.cx,
        intrinsics.cy,
        intrinsics.width,
        intrinsics.height,
        tuple(intrinsics.distortion),
    )


def intrinsics_of(camera: DepthCamera) -> wire.Intrinsics:
    """Return an engine camera as the intrinsics of a hello."""
    return wire.Intrinsics(
        camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height, tuple(camera.distortion)
    )


def camera_frame(camera: str, joint_set: str, message: wire.SkeletonFrame) -> CameraFrame:
    """Return a frame in canonical joints; device joints become canonical only here.

    Raises:
        FormatError: an unknown joint set, or a frame that does not fit it.
    """
    first, *others = (_body(camera, joint_set, one) for one in wire.each_body(message))
    return replace(first, others=tuple(others)) if others else first


def _body(camera: str, joint_set: str, message: wire.SkeletonFrame) -> CameraFrame:
    positions, confidence = wire.joint_arrays(message, joint_set)
    picture = _picture(joint_set, message, confidence)
    seen = to_canonical(joint_set, positions, confidence) if picture is None else (_UNSEEN.copy(), picture[1])
    return CameraFrame(
        camera=camera,
        sequence=message.sequence,
        device_time_ns=message.device_time_ns,
        positions=seen[0],
        confidence=seen[1],
        hands=tuple(HandSeen(hand.side, hand.method, hand.open_probability) for hand in message.hands),
        head_wxyz=message.head_wxyz,
        picture=None if picture is None else picture[0],
        body=message.body,
    )


def _picture(
    joint_set: str, message: wire.SkeletonFrame, visibility: NDArray[np.float64]
) -> tuple[PictureJoints, NDArray[np.float64]] | None:
    """Return a frame's landmarks as canonical joints, and their confidence, shape (21,); None where it has none."""
    seen = wire.landmark_arrays(message, joint_set)
    if seen is None:
        return None
    flat = np.concatenate([seen.pixels, np.zeros((len(seen.pixels), 1))], axis=1)
    pixels, confidence = to_canonical(joint_set, flat, visibility)
    world_m = _UNSEEN.copy()
    if seen.world_m is not None:
        world_m, _ = to_canonical(joint_set, seen.world_m, visibility)
    looks = face.seen_in(joint_set, seen.pixels, visibility)
    return PictureJoints(seen.width, seen.height, pixels[:, :2], world_m, _hands(seen), looks), confidence


def _hands(seen: wire.LandmarkArrays) -> NDArray[np.float64] | None:
    """Return the pixels of the left and the right hand, shape (2, 21, 2); None where neither is seen."""
    both = seen.left_hand, seen.right_hand
    if all(hand is None or np.isnan(hand).all() for hand in both):
        return None
    return np.array([np.full((wire.HAND_LANDMARKS, 2), np.nan) if hand is None else hand for hand in both])
