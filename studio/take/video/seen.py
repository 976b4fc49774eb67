"""Data besides a camera's video: its landmarks as recorded, and its frames' times on one clock."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.take.folder.take import Take
from studio.take.raw.clocks import TakeClocks
from studio.take.raw.frames import RawCamera, RawEvent, RawFrame, read_raw
from studio.take.video.kept import KeptVideo


@dataclass(frozen=True)
class VideoSeen:
    """A camera's pictures and landmarks, on the camera's last clock, that of the take's calibration.

    Attributes:
        times_ns: capture time of each picture that can be placed, increasing [ns], shape (picture_count,).
        numbers: its number through all of the camera's videos, shape (picture_count,).
        joint_set: of the landmarks.
        pose_times_ns: capture time of each frame of landmarks, increasing [ns], shape (frame_count,).
        pixels: shape (frame_count, joint_count, 2), as shares of the picture's width and height, from its left upper
            corner; NaN = unseen.
        size: of the pictures in which the landmarks were found, width and height [pixels]; None = there are none.
    """

    times_ns: NDArray[np.int64]
    numbers: NDArray[np.int64]
    joint_set: str
    pose_times_ns: NDArray[np.int64]
    pixels: NDArray[np.float64]
    size: tuple[int, int] | None


def video_seen(take: Take, videos: Sequence[KeptVideo]) -> VideoSeen:
    """Return a camera's pictures and landmarks; reads all of `raw.mcap`.

    Args:
        videos: those of the camera, one at least.
    """
    camera = videos[0].camera
    clocks = TakeClocks()
    joint_sets: dict[str, str] = {}
    frames: list[tuple[str, int, int, NDArray[np.float64]]] = []
    joint_set, size = "canonical", None
    for record in read_raw(take.raw_path):
        if isinstance(record, RawEvent):
            clocks.event(record.event)
        elif isinstance(record, RawCamera) and record.hello.name == camera:
            joint_sets[record.hello.boot_id] = joint_set = record.hello.joint_set
        elif isinstance(record, RawFrame) and record.camera == camera:
            found = wire.landmark_arrays(record.message, joint_sets.get(record.boot_id, joint_set))
            if found is not None:
                size = (found.width, found.height)
                shares = (found.pixels + 0.5) / size
                frames.append(
                    (record.boot_id, record.message.sequence, record.message.device_time_ns, shares)
                )

    def placed(boot_id: str, sequence: int, time_ns: int) -> int | None:
        return clocks.placed_ns(camera, boot_id, sequence, time_ns)

    pictures: dict[int, int] = {}
    number = 0
    for video in videos:
        for time_ns in video.times_ns.tolist():
            at_ns = placed(video.boot_id, video.from_sequence, time_ns)
            if at_ns is not None:
                pictures.setdefault(at_ns, number)
            number += 1
    poses: dict[int, NDArray[np.float64]] = {}
    for boot_id, sequence, time_ns, pixels in frames:
        at_ns = placed(boot_id, sequence, time_ns)
        if at_ns is not None and (not poses or pixels.shape == next(iter(poses.values())).shape):
            poses.setdefault(at_ns, pixels)
    times, pose_times = sorted(pictures), sorted(poses)
    return VideoSeen(
        times_ns=np.array(times, np.int64),
        numbers=np.array([pictures[at] for at in times], np.int64),
        joint_set=joint_set,
        pose_times_ns=np.array(pose_times, np.int64),
        pixels=np.array([poses[at] for at in pose_times]).reshape(len(pose_times), -1, 2),
        size=size,
    )
