"""A camera's video next to the replay: the picture of each frame, and what is drawn over it."""

from dataclasses import dataclass

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from studio.engine.base.errors import TakeError
from studio.engine.base.geometry import transform_points
from studio.engine.base.sentences import Said, say
from studio.engine.model.joints import OUTPUT_JOINTS, OUTPUT_PARENTS, PARENTS
from studio.take.video.seen import VideoSeen
from studio.web.playback.clip import Clip

NEAR_S = 0.1
"""Maximum distance between a frame of the replay and the nearest picture, which stands for it [s]."""

NEAREST_M = 0.1
"""Minimum distance from the camera of joints that are drawn [m]."""

MOST_DRAWN = 600
SAME_NS = 4_000_000
"""Maximum time between a picture and its landmarks [ns]; clocks that jumped are related this accurately."""

_FINE = 10_000.0

BODY_BONES = [
    (11, 12), (11, 13), (13, 15), (12, 14), (14, 16), (11, 23), (12, 24), (23, 24), (23, 25), (25, 27), (24, 26),
    (26, 28), (27, 29), (29, 31), (27, 31), (28, 30), (30, 32), (28, 32), (15, 19), (16, 20), (0, 11), (0, 12),
]  # fmt: skip
"""Bones between the 33 landmarks of BlazePose."""


class VideoShown(Struct):
    """A camera's video as the replay shows it.

    Attributes:
        camera: its name.
        pictures: by frame of the replay, the number of its picture through all videos of the camera; -1 = none.
        order: numbers of the pictures in order of time; requests for what is drawn over them use places in this list.
        bones: of the landmarks, pairs of their numbers.
        skeleton_bones: of the solved skeleton, pairs of numbers of `skeleton_joints`.
        no_landmarks, no_skeleton: why these cannot be drawn; "" = they can.
    """

    camera: str
    pictures: list[int]
    order: list[int]
    bones: list[tuple[int, int]]
    skeleton_bones: list[tuple[int, int]]
    skeleton_joints: list[str]
    no_landmarks: str
    no_skeleton: str


class PlaceInPicture(Struct):
    """Position of a joint seen at a place in a picture.

    Attributes:
        time_s: capture time of the picture, stage time [s].
        place_m: stage frame [m], at the assumed distance from the camera.
    """

    time_s: float
    place_m: tuple[float, float, float]


class Drawn(Struct):
    """Points drawn over pictures: by picture x and y of each joint in turn, in ten thousandths of the picture's
    width and height; null = the joint is not drawn, or nothing is.
    """

    first: int
    landmarks: list[list[int | None] | None]
    skeleton: list[list[int | None] | None]


@dataclass(frozen=True)
class ReplayedVideo:
    """A camera's video on the clock of a clip.

    Attributes:
        seen: the pictures and landmarks.
        times_s: of each picture on the stage clock [s], shape (picture_count,).
    """

    clip: Clip
    camera: str
    seen: VideoSeen
    times_s: NDArray[np.float64]

    @classmethod
    def of(cls, clip: Clip, camera: str, seen: VideoSeen) -> "ReplayedVideo":
        clock = clip.clock(camera)
        times_s = seen.times_ns.astype(np.float64) * 1e-9
        times_s = times_s if clock is None else clock.stage_s(times_s)
        return cls(clip, camera, seen, times_s)

    def shown(self) -> VideoShown:
        """Return the picture of each frame, and what can be drawn over it."""
        order = self.seen.numbers.tolist()
        nearest = nearest_of(self.times_s, self.clip.poses.time_s)
        pictures = [order[place] if place >= 0 else -1 for place in nearest.tolist()]
        of_body = self.seen.joint_set == "mediapipe"
        canonical = [(int(parent), child) for child, parent in enumerate(PARENTS) if parent >= 0]
        skeleton = [(int(parent), child) for child, parent in enumerate(OUTPUT_PARENTS) if parent >= 0]
        return VideoShown(
            camera=self.camera,
            pictures=pictures,
            order=order,
            bones=BODY_BONES if of_body else canonical if self.seen.joint_set == "canonical" else [],
            skeleton_bones=skeleton,
            skeleton_joints=list(OUTPUT_JOINTS),
            no_landmarks=""
            if len(self.seen.pose_times_ns)
            else say("video.no_landmarks", "no landmarks of {name} were recorded", name=self.camera),
            no_skeleton=self._no_skeleton(),
        )

    def drawn(self, first: int, last: int) -> Drawn:
        """Return the points drawn over pictures, by their places in the order of time, at most `MOST_DRAWN`."""
        places = np.arange(max(first, 0), min(last + 1, first + MOST_DRAWN, len(self.times_s)))
        return Drawn(first, self._landmarks(places), self._skeleton(places))

    def place(self, number: int, x: float, y: float, near_m: tuple[float, float, float]) -> PlaceInPicture:
        """Return a joint's position on the ray of a place in a picture, where the ray is nearest to a given point.

        Args:
            number: of the picture, through all videos of the camera.
            x, y: shares of the picture's width and height, from its left upper corner.
            near_m: approximate position of the joint, stage frame [m].

        Raises:
            TakeError: no such picture; the camera's place or lens is unknown, or no ray reaches there.
        """
        why, calibration = self._no_skeleton(), self.clip.calibration
        if why or calibration is None:
            raise TakeError("video.no_place", "no place in the stage: {why}", why=why)
        at = np.flatnonzero(self.seen.numbers == number)
        if not len(at):
            raise TakeError(
                "video.no_number", "the video of {name} has no picture {n}", name=self.camera, n=number
            )
        camera = calibration.cameras[self.camera]
        assert camera.lens is not None
        slope = camera.lens.rays_of(
            np.array([x, y], np.float64) * (camera.lens.width, camera.lens.height) - 0.5
        )
        ray = np.array([*slope, 1.0]) / np.sqrt(1.0 + (slope**2).sum())
        near = np.array(near_m) - camera.T_stage_camera[:3, 3]
        away_m = float(near @ camera.T_stage_camera[:3, :3] @ ray)
        if not away_m > NEAREST_M:  # also without a ray
            raise TakeError(
                "video.no_ray",
                "nothing of the stage is at this place of {name}'s picture; give one nearer to the joint",
                name=self.camera,
            )
        x_m, y_m, z_m = transform_points(camera.T_stage_camera, away_m * ray).tolist()
        return PlaceInPicture(float(self.times_s[at[0]]), (x_m, y_m, z_m))

    def _no_skeleton(self) -> str | Said:
        camera = None if self.clip.calibration is None else self.clip.calibration.cameras.get(self.camera)
        if not self.clip.solve:
            return say("video.no_solve", "without a solve there is no skeleton to draw; solve the take")
        if camera is None:
            return say(
                "video.not_calibrated",
                "the calibration in use does not place {name}: no skeleton can be drawn over its video",
                name=self.camera,
            )
        if camera.lens is None or (self.seen.size and camera.lens.sized(*self.seen.size) is None):
            return say(
                "video.no_lens",
                "the calibration in use has no lens of {name} for these pictures: no skeleton can be drawn over them",
                name=self.camera,
            )
        return ""

    def _landmarks(self, places: NDArray[np.int64]) -> list[list[int | None] | None]:
        """Return the landmarks found in each of these pictures; None for a skipped picture."""
        times = self.seen.pose_times_ns
        found: list[list[int | None] | None] = []
        for time_ns in self.seen.times_ns[places].tolist():
            at = int(np.searchsorted(times, time_ns - SAME_NS))
            known = at < len(times) and times[at] <= time_ns + SAME_NS
            found.append(_fine(self.seen.pixels[at]) if known else None)
        return found

    def _skeleton(self, places: NDArray[np.int64]) -> list[list[int | None] | None]:
        """Return the solved skeleton in each of these pictures, at the picture's own time."""
        poses, calibration = self.clip.poses, self.clip.calibration
        if self._no_skeleton() or calibration is None or not poses.frame_count:
            return [None] * len(places)
        camera = calibration.cameras[self.camera]
        assert camera.lens is not None
        T_camera_stage = np.linalg.inv(camera.T_stage_camera)
        found: list[list[int | None] | None] = []
        for time_s in self.times_s[places].tolist():
            after = int(np.searchsorted(poses.time_s, time_s))
            before = min(max(after - 1, 0), poses.frame_count - 1)
            after = min(after, poses.frame_count - 1)
            apart_s = poses.time_s[after] - poses.time_s[before]
            if not poses.time_s[0] - NEAR_S <= time_s <= poses.time_s[-1] + NEAR_S:
                found.append(None)
                continue
            share = 0.0 if apart_s <= 0 else (time_s - poses.time_s[before]) / apart_s
            joints = (1.0 - share) * poses.positions_m[before] + share * poses.positions_m[after]
            points = joints @ T_camera_stage[:3, :3].T + T_camera_stage[:3, 3]
            points[points[:, 2] < NEAREST_M] = np.nan
            pixels = camera.lens.pixels_of(points)
            found.append(_fine((pixels + 0.5) / (camera.lens.width, camera.lens.height)))
        return found


def nearest_of(times_s: NDArray[np.float64], frames_s: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return for each frame the index of the nearest picture, -1 if none is near, shape of `frames_s`."""
    if not len(times_s):
        return np.full(len(frames_s), -1)
    after = np.clip(np.searchsorted(times_s, frames_s), 0, len(times_s) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(frames_s - times_s[before] <= times_s[after] - frames_s, before, after)
    return np.where(np.abs(times_s[nearest] - frames_s) <= NEAR_S, nearest, -1)


def _fine(shares: NDArray[np.float64]) -> list[int | None]:
    """Return shares of a picture as whole numbers; points far outside are left out."""
    near = np.isfinite(shares).all(axis=1, keepdims=True) & (np.abs(shares) < 4.0).all(axis=1, keepdims=True)
    whole = np.where(near, np.rint(np.where(near, shares, 0.0) * _FINE), np.nan).ravel()
    return [None if number != number else int(number) for number in whole.tolist()]
