"""A tracker's errors on true joints: the noise specification of `studio simulate --tracker noisy-joints`.

Per camera and joint:
- an anatomical offset fixed in the bone's frame, SD 1 cm per axis, the same for all cameras;
- a bias of 3 cm towards the camera;
- AR(1) noise, 0.8 per frame at 30 Hz, SD 0.0016 z^2 m (z = distance) along the ray and 1 cm across it, times
  0.7 for the trunk, 1 for elbow and knee, 1.5 for wrist and ankle, 2 for hand and toe;
- occlusion by another body part: 4 times the noise, and a confidence of 0.2 to 0.5 instead of 0.85 to 1;
- outliers: 1 % of joint-frames, 20 to 50 cm off at confidence 1, in bursts of 1 to 10, a new direction every frame;
- dropouts: 3 % of joint-frames, in bursts of 2 to 12;
- left and right swapped half of the time while the camera sees the performer from behind.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import cross, invert_transform
from studio.engine.model.joints import CANONICAL, INDEX, JOINT_COUNT, MIRROR
from studio.simulator.joints.bone_frames import bone_frames
from studio.simulator.joints.occlusion import hidden_joints

FRAMES_PER_SECOND = 30.0
_TOWARDS_CAMERA_M = 0.03
_AR = 0.8
_ALONG_PER_M = 0.0016
_ACROSS_M = 0.01
_HIDDEN_TIMES = 4.0
_FACTORS = {"elbow": 1.0, "knee": 1.0, "wrist": 1.5, "ankle": 1.5, "hand": 2.0, "toe": 2.0}  # others: trunk
_FACTOR = np.array([_FACTORS.get(name.split("_")[-1], 0.7) for name in CANONICAL])
_OUTLIERS = (0.01, 1, 10)  # share of joint-frames, shortest and longest burst
_DROPS = (0.03, 2, 12)
_SWAPS = (4, 20)  # frames until a camera behind the performer may change its state


def anatomical_offsets(rng: np.random.Generator) -> NDArray[np.float64]:
    """Return one performer's offsets from joint centres to tracked joints, in bone frames [m], (21, 3)."""
    return rng.normal(0.0, 0.01, (JOINT_COUNT, 3))


@dataclass(frozen=True)
class _TrueView:
    """A camera's view without errors, in the camera frame; the leading axis is frames.

    Attributes:
        joints: tracked points before noise [m], shape (F, 21, 3).
        rays: unit directions from the camera, shape (F, 21, 3).
        ranges: distances from the camera [m], shape (F, 21).
        hidden: occluded joints, shape (F, 21).
        behind: frames from behind, shape (F,).
    """

    joints: NDArray[np.float64]
    rays: NDArray[np.float64]
    ranges: NDArray[np.float64]
    hidden: NDArray[np.bool_]
    behind: NDArray[np.bool_]


class NoisyJoints:
    """One camera's tracker. It is stateful: frames must be given in order, at about 30 Hz.

    Args:
        T_stage_camera: the camera's pose, 4x4.
        body_m: T-pose offsets of the performer, shape (21, 3); see `CanonicalMotion`.
        anatomy_m: see `anatomical_offsets`; the same for all cameras.
        rng: this camera's own stream.
    """

    def __init__(
        self,
        T_stage_camera: NDArray[np.float64],
        body_m: NDArray[np.float64],
        anatomy_m: NDArray[np.float64],
        rng: np.random.Generator,
    ) -> None:
        self._T_camera_stage = invert_transform(T_stage_camera)
        self._eye = T_stage_camera[:3, 3]
        self._body = body_m
        self._anatomy = anatomy_m
        self._rng = rng
        self._noise = rng.normal(size=(JOINT_COUNT, 3))
        self._outlier_left = np.zeros(JOINT_COUNT, dtype=np.int64)
        self._drop_left = np.zeros(JOINT_COUNT, dtype=np.int64)
        self._swap_left = 0
        self._swapped = False

    def see(self, joints_m: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the next frame: joints in the camera frame [m], (21, 3), NaN = unseen; confidence, (21,).

        Args:
            joints_m: true joint centres in the stage frame at the frame's instant, shape (21, 3).
        """
        positions, confidence = self.see_all(joints_m[None])
        return positions[0], confidence[0]

    def see_all(
        self, joints_m: NDArray[np.float64], hidden: NDArray[np.bool_] | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the next frames, shapes (F, 21, 3) and (F, 21), bit for bit as successive calls of `see`.

        `hidden`: joints that another performer hides, shape (F, 21).
        """
        view = self._view(joints_m)
        if hidden is not None:
            view = replace(view, hidden=view.hidden | hidden)
        positions = np.empty(joints_m.shape)
        confidence = np.empty(joints_m.shape[:2])
        for f in range(len(joints_m)):
            positions[f], confidence[f] = self._frame(view, f)
        return positions, confidence

    def _view(self, joints: NDArray[np.float64]) -> _TrueView:
        offset = (bone_frames(joints, self._body) * self._anatomy[:, None, :]).sum(axis=-1)
        shifted = joints + offset
        rotation, translation = self._T_camera_stage[:3, :3], self._T_camera_stage[:3, 3]
        points = (rotation * shifted[..., None, :]).sum(axis=-1) + translation
        ranges = np.sqrt((points * points).sum(-1))
        rays = points / ranges[..., None]
        left = joints[:, INDEX["left_shoulder"]] - joints[:, INDEX["right_shoulder"]]
        to_eye = self._eye - joints[:, INDEX["hips"]]
        facing = left[:, 1] * to_eye[:, 0] - left[:, 0] * to_eye[:, 1]  # left x up points forwards
        tracked = points - _TOWARDS_CAMERA_M * rays
        return _TrueView(tracked, rays, ranges, hidden_joints(joints, self._eye), facing < 0)

    def _frame(self, view: _TrueView, f: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rng = self._rng  # every frame draws equally many numbers, whatever its content
        self._noise = _AR * self._noise + np.sqrt(1 - _AR**2) * rng.normal(size=(JOINT_COUNT, 3))
        confidence_draw, reach = rng.random(JOINT_COUNT), rng.uniform(0.2, 0.5, JOINT_COUNT)
        way = rng.normal(size=(JOINT_COUNT, 3))
        off = self._burst(self._outlier_left, *_OUTLIERS)
        dropped = self._burst(self._drop_left, *_DROPS)
        swapped = self._is_swapped(bool(view.behind[f]))
        ray, hidden = view.rays[f], view.hidden[f]
        scale = _FACTOR * np.where(hidden, _HIDDEN_TIMES, 1.0)
        aside, down = _across(ray)
        along_m = _ALONG_PER_M * view.ranges[f] ** 2 * scale * self._noise[:, 0]
        across_m = _ACROSS_M * scale[:, None] * self._noise[:, 1:]
        positions = view.joints[f] + along_m[:, None] * ray
        positions += across_m[:, :1] * aside + across_m[:, 1:] * down
        confidence = np.where(hidden, 0.2 + 0.3 * confidence_draw, 0.85 + 0.15 * confidence_draw)
        way *= (reach / np.sqrt((way * way).sum(-1)))[:, None]
        positions = np.where(off[:, None], positions + way, positions)
        confidence = np.where(off, 1.0, confidence)
        if swapped:
            positions, confidence = positions[MIRROR], confidence[MIRROR]
        return np.where(dropped[:, None], np.nan, positions), np.where(dropped, 0.0, confidence)

    def _burst(self, left: NDArray[np.int64], share: float, shortest: int, longest: int) -> NDArray[np.bool_]:
        """Joints in a burst in this frame; updates `left`, the number of remaining frames of each burst."""
        mean = (shortest + longest) / 2
        starts = self._rng.random(JOINT_COUNT) < share / ((1 - share) * mean)
        lengths = self._rng.integers(shortest, longest + 1, JOINT_COUNT)
        left[:] = np.where(left > 0, left - 1, 0)
        np.copyto(left, lengths, where=(left == 0) & starts)
        return left > 0

    def _is_swapped(self, behind: bool) -> bool:
        draw, length = self._rng.random(), int(self._rng.integers(_SWAPS[0], _SWAPS[1] + 1))
        if self._swap_left == 0:
            self._swap_left, self._swapped = length, bool(draw < 0.5)
        self._swap_left -= 1
        return behind and self._swapped


def _across(ray: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two unit directions across each ray: sideways and down in the picture."""
    aside: NDArray[np.float64] = cross(np.array([0.0, 1.0, 0.0]), ray)
    aside /= np.sqrt((aside * aside).sum(-1, keepdims=True))
    return aside, cross(ray, aside)
