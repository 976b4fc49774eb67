"""A webcam, with MediaPipe's pose landmarker and a model file from the user.

MediaPipe gives the body in metres about the middle of the hips, and its place in the image. Its distance follows
from both, by the size of the body in the image. The lens is assumed to have a usual webcam's field of view.
"""

import os
import sys
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from studio.camera.devices.common import checked_number, device_number, library, polled
from studio.camera.devices.plugged import camera_name, video_devices
from studio.camera.sources.config import DeviceConfig, FoundDevice
from studio.camera.sources.depth_source import DeviceLostError
from studio.camera.sources.pacing import WallClock
from studio.camera.sources.picture import no_image
from studio.camera.sources.source import Source, SourceFrame
from studio.engine.base.errors import NotAvailableError, SettingsError
from studio.engine.base.sentences import say
from studio.engine.model.joints import JOINT_SETS

FIELD_OF_VIEW_DEG = 65.0
"""Across the image; common webcams have 55 to 78 degrees."""

_KIND = "webcam"
_INSTALL = "install the extra: uv sync --extra webcam"
_LEAST_VISIBLE = 0.3
_DARK_FRAMES = 5
"""Frames in which a webcam finds its exposure."""

MODEL = "STUDIO_WEBCAM_MODEL"
"""Environment variable with the model file for webcams that are connected from the page."""


@dataclass(frozen=True)
class WebcamConfig(DeviceConfig):
    """A webcam, `webcam:<model file>[#<number>]`.

    Attributes:
        model: file of a pose landmarker of MediaPipe.
        number: of the webcam, from 0.

    Raises:
        SettingsError: a number that no device has, or no model file.
    """

    model: str | Path
    number: int = 0

    def __post_init__(self) -> None:
        checked_number(self.number, _KIND)
        if not self.model or not Path(self.model).is_file():
            argument = f"{self.model}#{self.number}" if self.number else self.model
            raise SettingsError(
                "source.no_model",
                "source webcam:{argument}: no model file {model!r}; get a pose landmarker "
                "(pose_landmarker_full.task) from MediaPipe's documentation and give its path, as "
                "webcam:<model file>",
                argument=argument,
                model=str(self.model),
            )

    @classmethod
    def parse(cls, text: str) -> Self:
        model, _, number = text.partition("#")
        return cls(model, device_number(number, _KIND))

    @classmethod
    def find(cls) -> list[FoundDevice]:
        if sys.platform != "linux":
            raise NotAvailableError(
                "device.webcams_unlisted", "webcams are listed on Linux only; start one by the command"
            )
        model = os.environ.get(MODEL, "")
        return [
            FoundDevice(
                f"{_KIND}:{model or 'MODEL'}#{number}",
                name,
                camera_name(_KIND, str(number)),
                needs=_needs(model),
            )
            for number, name in video_devices()
        ]

    def picture(self) -> NDArray[np.uint8]:
        cv2 = library("cv2", kind=_KIND, install=_INSTALL)
        camera = cv2.VideoCapture(self.number)
        try:
            shots = [camera.read() for _ in range(_DARK_FRAMES)]
        finally:
            camera.release()
        found, image = shots[-1]
        if not found:
            raise no_image(f"webcam {self.number}")
        return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)

    def open(self) -> "WebcamSource":
        mediapipe = library("mediapipe", kind=_KIND, install=_INSTALL)
        vision = library("mediapipe.tasks.python.vision", kind=_KIND, install=_INSTALL)
        tasks = library("mediapipe.tasks.python", kind=_KIND, install=_INSTALL)
        cv2 = library("cv2", kind=_KIND, install=_INSTALL)
        options = vision.PoseLandmarkerOptions(
            base_options=tasks.BaseOptions(model_asset_path=str(self.model)),
            running_mode=vision.RunningMode.VIDEO,
        )
        try:
            landmarker = vision.PoseLandmarker.create_from_options(options)
        except (RuntimeError, ValueError) as error:
            raise SettingsError(
                "source.not_a_model",
                "{model} is no pose landmarker model of MediaPipe ({error})",
                model=self.model,
                error=error,
            ) from error
        camera = cv2.VideoCapture(self.number)
        if not camera.isOpened():
            raise DeviceLostError(
                "device.no_webcam", "no webcam number {number} is plugged in", number=self.number
            )
        return WebcamSource(mediapipe, cv2, landmarker, camera)


def _needs(model: str) -> str:
    """Return what webcams lack before they can be opened; "" = nothing."""
    try:
        library("mediapipe", kind=_KIND, install=_INSTALL)
    except NotAvailableError as error:
        return error.sentence
    if not Path(model).is_file():
        return say(
            "device.webcam_model",
            "webcams need a pose landmarker of MediaPipe: start the studio with its file as {variable}",
            variable=MODEL,
        )
    return ""


class WebcamSource(Source):
    """The pose of one person in front of a webcam."""

    name, device, joint_set = "webcam", "webcam, MediaPipe", "mediapipe"

    def __init__(self, mediapipe: Any, cv2: Any, landmarker: Any, camera: Any) -> None:
        self._mediapipe, self._cv2 = mediapipe, cv2
        self._landmarker, self._camera = landmarker, camera
        self._wall = WallClock()

    def clock_ns(self) -> int:
        return self._wall.now_ns()

    async def frames(self) -> AsyncIterator[SourceFrame]:
        def wait() -> SourceFrame | None:
            found, image = self._camera.read()
            time_ns = self._wall.now_ns()
            if not found:
                raise OSError("the webcam gives no more images")
            colours = self._cv2.cvtColor(image, self._cv2.COLOR_BGR2RGB)
            picture = self._mediapipe.Image(image_format=self._mediapipe.ImageFormat.SRGB, data=colours)
            result = self._landmarker.detect_for_video(picture, time_ns // 1_000_000)
            if not result.pose_landmarks:
                return None
            seen, body = result.pose_landmarks[0], result.pose_world_landmarks[0]
            pixels = np.array([[p.x, p.y] for p in seen]) * [image.shape[1], image.shape[0]]
            metres = np.array([[p.x, p.y, p.z] for p in body])
            visible = np.clip([p.visibility for p in seen], 0.0, 1.0)
            return SourceFrame(time_ns, *placed(metres, pixels, visible, image.shape[1], image.shape[0]))

        def close() -> None:
            self._camera.release()
            self._landmarker.close()

        async for frame in polled(wait, close):
            yield frame


def placed(
    metres: NDArray[np.float64],
    pixels: NDArray[np.float64],
    visible: NDArray[np.float64],
    width: int,
    height: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return joints in the camera frame [m], shape (33, 3), and confidence, from a body without a position.

    The body's translation t solves `(x + tx) = u (z + tz)` and `(y + ty) = v (z + tz)` over all visible joints, with
    u and v the rays of their pixels: linear least squares.

    Args:
        metres: joints about the middle of the hips, image axes, shape (33, 3).
        pixels: their places in the image, shape (33, 2).
        visible: 0..1, shape (33,).
        width, height: of the image [pixels].
    """
    focal = 0.5 * width / np.tan(np.radians(0.5 * FIELD_OF_VIEW_DEG))
    rays = (pixels - 0.5 * np.array([width, height])) / focal
    used = visible > _LEAST_VISIBLE
    if used.sum() < 4:
        return np.full((len(JOINT_SETS["mediapipe"]), 3), np.nan), np.zeros(len(JOINT_SETS["mediapipe"]))
    rows, sides = [], []
    for axis in (0, 1):
        row = np.zeros((used.sum(), 3))
        row[:, axis], row[:, 2] = 1.0, -rays[used, axis]
        rows.append(row * visible[used, None])
        sides.append((rays[used, axis] * metres[used, 2] - metres[used, axis]) * visible[used])
    place, *_ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(sides), rcond=None)
    if place[2] < 0.3:
        return np.full(metres.shape, np.nan), np.zeros(len(metres))
    return metres + place, visible
