"""Takes whose videos show a board: its picture is projected into them by the true cameras."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.engine.base.geometry import invert_transform, make_transform, transform_points
from studio.engine.seeing.board import Board
from studio.take.folder.new import new_take
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter
from studio.take.video.kept import keep_video
from tests.engine.calibration.views.synthetic import LENS, camera_at, view_of
from tests.take.video_files import write_video

SECONDS = 10.0
STEP_MS = 500
CAMERAS = {name: camera_at(angle, 3.8, 2.1) for name, angle in (("left", 0.0), ("right", 85.0))}
"""True cameras; the performer is 1.8 m tall."""

A0 = Board.parse("charuco:4x5:200:150:4x4_50")
TAG = Board.parse("apriltag:400")
_PIXELS_PER_M = 400


@dataclass(frozen=True)
class Shown:
    """A board at a place: `T_stage_board` takes points on it (x right, y down, z into it, from its middle [m])."""

    board: Board
    T_stage_board: NDArray[np.float64]
    number: int = 0
    old: bool = False

    def picture(self) -> NDArray[np.uint8]:
        """The board as printed."""
        what = self.board
        if what.kind == "apriltag":
            family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
            side = round(what.size_m * _PIXELS_PER_M)
            return np.pad(cv2.aruco.generateImageMarker(family, self.number, side), 0)
        words = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        board = cv2.aruco.CharucoBoard((what.columns, what.rows), what.size_m, what.marker_m, words)
        board.setLegacyPattern(self.old)
        size = [round(n * what.size_m * _PIXELS_PER_M) for n in (what.columns, what.rows)]
        return np.asarray(board.generateImage(size), np.uint8)

    def seen_by(self, T_stage_camera: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.uint8]:
        """A camera's picture, with a board on white paper, out of focus and with noise."""
        margin = 40
        picture = np.pad(self.picture(), margin, constant_values=255)
        rows, columns = picture.shape
        corners = np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], np.float64)
        on_board = (corners - [columns / 2, rows / 2]) / _PIXELS_PER_M
        stage = transform_points(self.T_stage_board, np.column_stack([on_board, np.zeros(4)]))
        pixels = LENS.pixels_of(transform_points(invert_transform(T_stage_camera), stage))
        homography = cv2.getPerspectiveTransform(
            (corners - 0.5).astype(np.float32), pixels.astype(np.float32)
        )
        size = (LENS.width, LENS.height)
        shown = cv2.warpPerspective(picture, homography, size, flags=cv2.INTER_AREA, borderValue=110)
        noisy = cv2.GaussianBlur(shown, (0, 0), 0.6) * 0.8 + 20 + rng.normal(0.0, 3.0, shown.shape)
        return np.repeat(np.clip(noisy, 0, 255).astype(np.uint8)[..., None], 3, axis=2)


def lying(x: float, y: float, turn_deg: float) -> NDArray[np.float64]:
    """A board on the floor, pattern up."""
    a = np.radians(turn_deg)
    across = np.array([np.cos(a), np.sin(a), 0.0])
    down = np.array([np.sin(a), -np.cos(a), 0.0])
    return make_transform(np.column_stack([across, down, np.cross(across, down)]), np.array([x, y, 0.0]))


def held() -> NDArray[np.float64]:
    """A board that stands upright in front of both cameras."""
    to_cameras = sum(T[:3, 3] for T in CAMERAS.values()) * [1.0, 1.0, 0.0]
    into = -to_cameras / np.linalg.norm(to_cameras)
    down = np.array([0.0, 0.0, -1.0])
    return make_transform(np.column_stack([np.cross(down, into), down, into]), np.array([0.2, 0.2, 1.2]))


def take_with_boards(path: Path, shown: dict[str, list[Shown]], seconds: float = SECONDS) -> Take:
    """A walk before the cameras, each with a video that shows boards one after the other, grey without any."""
    rng = np.random.default_rng(4)
    path.parent.mkdir(parents=True, exist_ok=True)
    with new_take(path, source="import") as take:
        messages = []
        with RawWriter(take.raw_path) as writer:
            for k, (name, T) in enumerate(CAMERAS.items()):
                view = view_of(name, T, seed=k + 1, seconds=seconds)
                hello = wire.Hello(
                    protocol_version=wire.PROTOCOL_VERSION, name=name, device="video", joint_set="canonical",
                    boot_id="import", frames_per_second=30,
                )  # fmt: skip
                take.add_camera(hello)
                writer.add_camera(hello)
                for f, time_s in enumerate(view.time_s.tolist()):
                    seen = wire.LandmarkArrays(LENS.width, LENS.height, view.pixels[f], view.world_m[f])
                    frame = wire.landmark_frame(f, round(time_s * 1e9), seen, view.confidence[f])
                    messages.append((time_s, name, frame))
            for time_s, name, frame in sorted(messages, key=lambda one: one[0]):
                writer.frame(
                    name, wire.encode(frame), arrival_ns=round(time_s * 1e9),
                    device_time_ns=frame.device_time_ns, sequence=frame.sequence,
                )  # fmt: skip
        for name, mine in shown.items():
            times_ms = list(range(0, round(1e3 * seconds), STEP_MS))
            nothing = np.full((LENS.height, LENS.width, 3), 110, np.uint8)
            pictures = [
                mine[k % len(mine)].seen_by(CAMERAS[name], rng) if mine else nothing
                for k in range(len(times_ms))
            ]
            video = write_video(path.parent / f"{name}.mp4", pictures, times_ms)
            at_ns = np.array(times_ms) * 1_000_000
            keep_video(take, video, camera=name, boot_id="import", at_ns=at_ns, times_ns=at_ns)
    return take
