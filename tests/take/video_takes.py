"""A take of two cameras of pictures, one with a video in which every picture shows its number."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.engine.base.geometry import make_transform
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.cameras.lens import Lens
from studio.engine.model.frames import ClockModel
from studio.engine.model.joints import JOINT_SETS
from studio.engine.model.settings.settings import preset
from studio.take.folder.new import new_take
from studio.take.folder.solves import write_solve
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter
from studio.take.video.kept import keep_video
from tests import poses_factory
from tests.take.video_files import write_video

COUNT, RATE_HZ = 60, 30
AHEAD_NS = 3_000_000_000
"""The camera's clock is so far ahead of the stage clock."""
BITS, WIDTH, HEIGHT = 7, 140, 160
LENS = Lens(300.0, 300.0, 139.5, 159.5, 2 * WIDTH, 2 * HEIGHT, (-0.08, 0.01, 0.001, 0.002))
"""Of pictures that are twice as large as the video."""
JOINTS = len(JOINT_SETS["mediapipe"])


def numbered_pictures(count: int = COUNT) -> list[NDArray[np.uint8]]:
    """Pictures with their number as black and white bars, the lowest bit on the left."""
    pictures = []
    for number in range(count):
        picture = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
        for bit in range(BITS):
            picture[:40, bit * 20 : bit * 20 + 20] = 255 if number >> bit & 1 else 0
        pictures.append(picture)
    return pictures


def number_in(bars: NDArray[np.floating]) -> int:
    """Return the number that is shown, from the brightness of each bar, shape (BITS,), 0..255."""
    assert ((bars < 70) | (bars > 185)).all(), bars
    return int(sum(1 << bit for bit, bright in enumerate(bars) if bright > 128))


def capture_ns(count: int = COUNT) -> NDArray[np.int64]:
    """Return the capture times of the pictures on the camera's clock [ns]."""
    return AHEAD_NS + np.arange(count) * 1_000_000_000 // RATE_HZ


def landmark_pixels(number: int) -> NDArray[np.float64]:
    """Return where the landmarks of a picture are, in pictures of `LENS`, shape (33, 2) [pixels]."""
    return np.stack([np.full(JOINTS, 20.0 + number), 150.0 + 4.0 * np.arange(JOINTS)], axis=1)


def calibration() -> Calibration:
    """Two cameras 3 m before the stage's origin; the first has a lens and a clock that is ahead."""
    looking_north = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    cameras = {
        name: CameraCalibration(
            make_transform(looking_north, np.array([x, -3.0, 1.0])),
            clock=ClockModel(offset_ns=-AHEAD_NS),
            lens=LENS,
        )
        for name, x in (("left", -0.2), ("right", 0.4))
    }
    return Calibration("left", cameras)


def take_with_video(
    path: Path, *, solved: bool = True, calibrated: bool = True, suffix: str = ".mp4"
) -> Take:
    """Make a take of two seconds whose camera `left` has a video, and `right` none."""
    times_ns = capture_ns()
    path.parent.mkdir(parents=True, exist_ok=True)
    video = write_video(
        path.parent.parent / f"numbers{suffix}", numbered_pictures(),
        [round(k * 1000 / RATE_HZ) for k in range(COUNT)],
    )  # fmt: skip
    with new_take(path, source="import") as take:
        with RawWriter(take.raw_path) as writer:
            for name in ("left", "right"):
                hello = wire.Hello(
                    protocol_version=wire.PROTOCOL_VERSION, name=name, device="video", joint_set="mediapipe",
                    boot_id="import", frames_per_second=RATE_HZ,
                )  # fmt: skip
                take.add_camera(hello)
                writer.add_camera(hello)
            for k, time_ns in enumerate(times_ns.tolist()):
                for name in ("left", "right"):
                    seen = wire.LandmarkArrays(LENS.width, LENS.height, landmark_pixels(k))
                    frame = wire.landmark_frame(k, time_ns, seen, np.ones(JOINTS))
                    writer.frame(
                        name, wire.encode(frame), arrival_ns=time_ns, device_time_ns=time_ns, sequence=k
                    )
        at_ns = np.array([round(k * 1000 / RATE_HZ) * 1_000_000 for k in range(COUNT)])
        keep_video(take, video, camera="left", boot_id="import", at_ns=at_ns, times_ns=times_ns)
        if calibrated:
            take.add_calibration(calibration(), use=True)
    if solved:
        poses = poses_factory.random_poses(np.random.default_rng(3), seconds=1.9)
        write_solve(take, "studio", settings=preset("studio"), poses=poses, metrics={})
    return take
