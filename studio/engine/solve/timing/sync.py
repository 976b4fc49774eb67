"""Synchronisation (step 3): camera clocks to the stage clock, and frames aligned at one instant.

It also transforms joints to the stage frame, for all later steps: by the camera's transform, and by the joint's bias
towards its camera (`depth_bias_m`), removed along the ray. The joints of cameras that see no depth lie on `rays`.
"""

from collections import deque
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import matrices, quaternions, transform_points
from studio.engine.calibration.cameras.noise import unbiased
from studio.engine.model.calibration import CameraCalibration, Performer, trunk_of
from studio.engine.model.frames import CameraFrame, ClockModel, FrameSet, HandSeen, PictureJoints, Reading
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.model.triangulation.guess import GUESSED_HEIGHT_M
from studio.engine.model.triangulation.rays import (
    FREE_M,
    GUESSED_M,
    face_on_rays,
    guessed,
    hands_on_rays,
    on_rays,
    placed,
)
from studio.engine.solve.timing.shutter import RollingShutter

MAX_GAP_NS = 100_000_000
"""Longest gap between two frames that is interpolated."""

MAX_AGE_NS = 60_000_000
"""Largest time between an instant and a frame that stands for it."""

FAR_M = 100.0
"""A joint that a camera reports further away than this, along any axis, is an error and counts as unseen."""

AHEAD_NS = 10_000_000_000
"""A frame this far ahead of its camera's last counts only when another follows, because a clock may be wrong once."""

MAX_AHEAD_NS = 40_000_000
"""A reading is used at most this long before its time, when the camera's next frame is mostly known."""

HISTORY = 32
"""Frames kept per camera."""


def _is_rotation(wxyz: tuple[float, float, float, float]) -> bool:
    """Whether a quaternion is a rotation: finite and not zero."""
    length = float(np.abs(wxyz).max())
    return 1e-3 < length < 1e3


_HANDS, _FACE = range(2)
_PartRays: TypeAlias = tuple[NDArray[np.float64] | None, NDArray[np.float64] | None]
"""Points on the rays of the landmarks of `_HANDS`, shape (2, 21, 3), and `_FACE`, shape (11, 3); None = not seen."""


class _Camera:
    """The newest frames of one camera, in the stage frame and on the stage clock."""

    def __init__(self) -> None:
        self.times: deque[int] = deque(maxlen=HISTORY)
        self.joints: deque[NDArray[np.float64]] = deque(maxlen=HISTORY)
        self.confidence: deque[NDArray[np.float64]] = deque(maxlen=HISTORY)
        self.frames: deque[CameraFrame] = deque(maxlen=HISTORY)
        self.parts: deque[_PartRays] = deque(maxlen=HISTORY)
        self.along_m: float | None = None
        self._held_back_ns: int | None = None
        self._read_ns: int | None = None

    def add(
        self,
        stage_ns: int,
        joints: NDArray[np.float64],
        frame: CameraFrame,
        parts: _PartRays,
    ) -> None:
        """Keep a frame. A frame that is not newer than the last is dropped (a clock that went back), and so is the
        first that is far ahead of it.
        """
        if self.times and stage_ns > self.times[-1] + AHEAD_NS:
            first, self._held_back_ns = self._held_back_ns, stage_ns
            if first is None or not 0 < stage_ns - first <= AHEAD_NS:
                return
        self._held_back_ns = None
        if self.times and stage_ns <= self.times[-1]:
            if stage_ns > self.times[-1] - 1_000_000_000:
                return
            for kept in (self.times, self.joints, self.confidence, self.frames, self.parts):
                kept.clear()
            self._read_ns = None
        self.times.append(stage_ns)
        self.joints.append(joints)
        self.confidence.append(frame.confidence)
        self.frames.append(frame)
        self.parts.append(parts)

    def at(self, stage_ns: int) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Joints and confidence at an instant: interpolated between the frames around it, else the nearest."""
        places = self._about(stage_ns)
        if not places:
            return None
        if len(places) == 2:
            return self._between(places[0], places[1], stage_ns)
        return self.joints[places[0]], self.confidence[places[0]]

    def _about(self, stage_ns: int) -> list[int]:
        """The two frames around an instant, for interpolation, else the nearest one; empty = none is near."""
        after = len(self.times)
        while after > 0 and self.times[after - 1] >= stage_ns:
            after -= 1
        if 0 < after < len(self.times) and self.times[after] - self.times[after - 1] <= MAX_GAP_NS:
            return [after - 1, after]
        near = [i for i in (after - 1, after) if 0 <= i < len(self.times)]
        near = [i for i in near if abs(self.times[i] - stage_ns) <= MAX_AGE_NS]
        return [min(near, key=lambda i: abs(self.times[i] - stage_ns))] if near else []

    def part_at(self, part: int, stage_ns: int) -> NDArray[np.float64] | None:
        """Points on the rays of `_HANDS` or `_FACE` at an instant, of its shape; None = not seen."""
        seen = [(i, rays) for i in self._about(stage_ns) if (rays := self.parts[i][part]) is not None]
        if not seen:
            return None
        (before, first), (after, last) = seen[0], seen[-1]
        if len(seen) == 1:
            return first
        share = (stage_ns - self.times[before]) / (self.times[after] - self.times[before])
        between = (1.0 - share) * first + share * last
        return np.where(np.isnan(between), first if share < 0.5 else last, between)

    def unread(self, stage_ns: int) -> list[int]:
        """Indices of unread frames, oldest first, up to the first after an instant.

        Frames that are too old or too far ahead are left out, so that the result does not depend on how many later
        frames have arrived.
        """
        if self._read_ns is not None and self._read_ns > stage_ns:
            return []
        first = len(self.times)
        while first > 0 and (self._read_ns is None or self.times[first - 1] > self._read_ns):
            first -= 1
        found = []
        for index in range(first, len(self.times)):
            time_ns = self.times[index]
            if time_ns > stage_ns + MAX_AHEAD_NS:
                break
            self._read_ns = time_ns
            if time_ns >= stage_ns - MAX_GAP_NS:
                found.append(index)
            if time_ns > stage_ns:
                break
        return found

    def _between(self, a: int, b: int, stage_ns: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        share = (stage_ns - self.times[a]) / (self.times[b] - self.times[a])
        joints = (1.0 - share) * self.joints[a] + share * self.joints[b]
        confidence = np.minimum(self.confidence[a], self.confidence[b])
        only_a, only_b = np.isnan(self.joints[b][:, 0]), np.isnan(self.joints[a][:, 0])
        one = only_a ^ only_b
        if one.any():  # seen in one of the two: the nearer frame decides
            pick, other = (a, only_a) if share < 0.5 else (b, only_b)
            use = one & other
            joints[use] = self.joints[pick][use]
            confidence = np.where(use, self.confidence[pick], confidence)
        return joints, np.where(np.isnan(joints[:, 0]), 0.0, confidence)


class Synchroniser:
    """Collects camera frames and returns frame sets at stage times."""

    def __init__(
        self,
        cameras: dict[str, CameraCalibration],
        *,
        ahead_ns: int = 0,
        performer: Performer | None = None,
    ) -> None:
        """Collect frames of these cameras.

        Args:
            cameras: by name.
            ahead_ns: look-ahead of the readings beyond the instant of a frame set [ns].
            performer: gives the size and trunk of the body in the pictures; None = a usual one.
        """
        self._calibrations = cameras
        self._alone = len(cameras) == 1
        self._scale = 1.0 if performer is None else performer.height_m / GUESSED_HEIGHT_M
        self._trunk = trunk_of(performer)
        self._ahead_ns = ahead_ns
        self._clocks: dict[str, ClockModel] = {name: camera.clock for name, camera in cameras.items()}
        self._cameras: dict[str, _Camera] = {name: _Camera() for name in cameras}
        self._shutters = {name: RollingShutter(camera.readout_ms * 1e-3) for name, camera in cameras.items()}
        self.names = tuple(cameras)
        self._positions = np.array([camera.T_stage_camera[:3, 3] for camera in cameras.values()]).reshape(
            -1, 3
        )

    def set_clock(self, camera: str, clock: ClockModel) -> None:
        """Use another clock for the camera's frames from now on; unknown cameras are ignored."""
        if camera in self._clocks:
            self._clocks[camera] = clock

    def add(self, frame: CameraFrame) -> None:
        """Add a frame; a frame of an uncalibrated camera is ignored."""
        calibration = self._calibrations.get(frame.camera)
        if calibration is None:
            return
        camera, parts = self._cameras[frame.camera], (None, None)
        picture = self._shutters[frame.camera].settled(frame)
        if picture is None:
            possible = np.logical_and.reduce(np.abs(frame.positions) < FAR_M, axis=1)
            positions = np.where(possible[:, None], frame.positions, np.nan)
            joints = transform_points(
                calibration.T_stage_camera, unbiased(positions, calibration.depth_bias_m)
            )
            camera.along_m = None
        else:
            picture = picture.of_body(self._trunk)
            joints = self._of_picture(calibration, picture, frame.confidence)
            possible = ~np.isnan(joints[:, 0])
            camera.along_m = GUESSED_M if self._alone else FREE_M
            hands = None if self._alone else hands_on_rays(calibration, picture)
            parts = (hands, face_on_rays(calibration, picture))
        frame = replace(frame, confidence=np.where(possible, frame.confidence, 0.0))
        camera.add(self._clocks[frame.camera].stage_ns(frame.device_time_ns), joints, frame, parts)

    def _of_picture(
        self, calibration: CameraCalibration, picture: PictureJoints, confidence: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Joints of a camera without depth in the stage frame [m], shape (21, 3): at guessed depths if it is the only
        camera, else anywhere on their rays."""
        if not self._alone:
            return on_rays(calibration, picture)
        return guessed(calibration, picture, confidence, self._scale)

    def _guessed_behind_m(self, frame: CameraFrame) -> NDArray[np.float64] | None:
        """Guessed distances of joints behind the hips; None for the only camera, whose positions contain them."""
        return None if frame.picture is None or self._alone else self._scale * frame.picture.world_m[:, 2]

    def newest_stage_ns(self) -> dict[str, int]:
        """Stage time of each camera's newest frame; cameras without one are left out."""
        return {name: camera.times[-1] for name, camera in self._cameras.items() if camera.times}

    def frame_set(self, stage_time_ns: int) -> FrameSet:
        """Return all cameras' joints at an instant; a camera without a frame near it has NaN joints."""
        positions = np.full((len(self.names), JOINT_COUNT, 3), np.nan)
        confidence = np.zeros((len(self.names), JOINT_COUNT))
        hands: list[HandSeen] = []
        head: tuple[float, float, float, float] | None = None
        readings: list[Reading] = []
        part_rays: list[NDArray[np.float64] | None] = [None, None]
        for i, (name, camera) in enumerate(self._cameras.items()):
            for k in camera.unread(stage_time_ns + self._ahead_ns):
                late_s = (camera.times[k] - stage_time_ns) * 1e-9
                behind_m = self._guessed_behind_m(camera.frames[k])
                readings.append(
                    Reading(i, late_s, camera.joints[k], camera.confidence[k], camera.along_m, behind_m)
                )
            found = camera.at(stage_time_ns)
            if found is None:
                continue
            positions[i], confidence[i] = found
            for part in (_HANDS, _FACE):
                if (own := camera.part_at(part, stage_time_ns)) is not None:
                    if (whole := part_rays[part]) is None:
                        whole = part_rays[part] = np.full((len(self.names), *own.shape), np.nan)
                    whole[i] = own
            newest = camera.frames[-1]
            hands.extend(newest.hands)
            if newest.head_wxyz is not None and head is None and _is_rotation(newest.head_wxyz):
                rotation = self._calibrations[name].T_stage_camera[:3, :3] @ matrices(
                    np.array(newest.head_wxyz)
                )
                w, x, y, z = (float(v) for v in quaternions(rotation))
                head = (w, x, y, z)
        rays = np.array([camera.along_m is not None for camera in self._cameras.values()], dtype=np.bool_)
        if rays.any() and not self._alone:
            positions, confidence = placed(positions, confidence, self._positions, rays)
        return FrameSet(
            stage_time_ns,
            self.names,
            positions,
            confidence,
            self._positions,
            tuple(hands),
            head,
            tuple(readings),
            rays,
            hand_rays=part_rays[_HANDS],
            face_rays=part_rays[_FACE],
        )
