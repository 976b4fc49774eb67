"""A pose network's errors on true landmarks: the specification of `studio simulate --tracker rgb`.

Per camera and landmark. Sizes are those of BlazePose (full) against hand-checked places in four real videos at 3.4 m,
and scale with the performer in the picture:
- an anatomical offset fixed in the bone's axes, SD 1 cm each, the same for all cameras of a performer;
- a shift that lasts some seconds (AR(1), 2 s), and noise from frame to frame (AR(1), 0.5 per frame at 30 Hz), SD by
  landmark (`_SIZES_M`);
- occlusion by another body part: 4 times both, and a visibility of 0.1 to 0.7 instead of 0.85 to 1;
- outliers: 1 % of landmark-frames, 5 to 20 cm off, in bursts of 1 to 6 frames;
- a face that glances about, with mostly common errors (`heads`);
- swaps of left and right in 3 % of the frames, in bursts of 1 to 8, and five times as often from behind;
- world landmarks about the hips as guessed from one picture: a usual stature, flattened by a tenth, turned by some
  degrees, and 4 cm off in depth.

A frame with over half of the landmarks outside the picture shows nobody. The lens is not nominal: its field of view
is 58 to 74 degrees, with some distortion.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform
from studio.engine.model.cameras.lens import Lens
from studio.engine.model.joints import INDEX
from studio.simulator.joints.occlusion import hidden_joints
from studio.simulator.landmarks.body import JOINT_OF, NAMES, PLACES, landmarks_of
from studio.simulator.landmarks.hand_tracker import HandTracker
from studio.simulator.landmarks.heads import FACE, FaceErrors, SimulatedHead, hidden_by_skull

WIDTH, HEIGHT = 1440, 1080
_FIELD_DEG = (58.0, 74.0)
_K1_SD = 0.03
_COUNT = len(NAMES)
_ANATOMY_M = 0.01
_SIZES_M = {  # SD of the lasting shift and of the noise
    "shoulder": (0.006, 0.007), "elbow": (0.008, 0.008), "wrist": (0.008, 0.008), "pinky": (0.010, 0.008),
    "index": (0.010, 0.008), "thumb": (0.010, 0.008), "hip": (0.011, 0.008), "knee": (0.011, 0.009),
    "ankle": (0.010, 0.008), "heel": (0.013, 0.009), "foot_index": (0.011, 0.009),
}  # fmt: skip
_FACE_M, _EAR_M, _FACE_ANATOMY = (0.008, 0.005), (0.010, 0.006), 0.6
"""Own errors of the face's landmarks and of the ears; factor of the anatomical offset on the face without ears."""

_BEHIND_TIMES, _BEHIND_GUESS = 2.0, 0.5
"""Error factor of a landmark behind the skull, and the share of its shift to its place on a straight head."""

_SHIFT_AR, _NOISE_AR = 0.9835, 0.5
_HIDDEN_TIMES = 4.0
_OUTLIERS = (0.01, 1, 6)
_EXCHANGES, _FROM_BEHIND = (0.03, 1, 8), 5.0
_LEAST_INSIDE = 0.5
_STATURE_M, _FLAT = 1.7, 0.9
_TURN_SD, _DEPTH_SD_M = np.radians(6.0), 0.04
_SIZE = np.array([
    _SIZES_M.get(name.split("_", 1)[-1], _EAR_M if name.endswith("ear") else _FACE_M) for name in NAMES
])  # fmt: skip
_ANATOMY = np.array([
    _FACE_ANATOMY if k < FACE.stop and not name.endswith("ear") else 1.0 for k, name in enumerate(NAMES)
])  # fmt: skip
_MIRROR = np.array(
    [NAMES.index(name.replace("left", "?").replace("right", "left").replace("?", "right")) for name in NAMES]
)


@dataclass(frozen=True)
class SeenPicture:
    """One frame of a camera: pixels, shape (33, 2); visibility, shape (33,); world landmarks [m], shape (33, 3);
    pixels of the left and the right hand, shape (2, 21, 2), NaN = not seen.
    """

    pixels: NDArray[np.float64]
    visibility: NDArray[np.float64]
    world_m: NDArray[np.float64]
    hands: NDArray[np.float64]

    def hand(self, side: int) -> NDArray[np.float64] | None:
        """Return the pixels of the left (0) or the right (1) hand, shape (21, 2); None = not seen."""
        return None if np.isnan(self.hands[side]).all() else self.hands[side]


def landmark_anatomy(rng: np.random.Generator) -> NDArray[np.float64]:
    """Return one performer's offsets of the landmarks, in the bones' axes [m], shape (33, 3)."""
    return _ANATOMY[:, None] * rng.normal(0.0, _ANATOMY_M, (_COUNT, 3))


def random_lens(rng: np.random.Generator) -> Lens:
    """Return a camera's lens, for pictures of 1440 x 1080."""
    focal = 0.5 * WIDTH / np.tan(np.radians(0.5 * rng.uniform(*_FIELD_DEG)))
    k1 = float(rng.normal(0.0, _K1_SD))
    return Lens(focal, focal, 0.5 * (WIDTH - 1), 0.5 * (HEIGHT - 1), WIDTH, HEIGHT, (k1, 0.0, 0.0, 0.0))


class LandmarkTracker:
    """One camera's pose network. It is stateful: frames must be given in order, at about 30 Hz.

    Args:
        T_stage_camera: the camera's pose, 4x4.
        lens: the camera's lens.
        body_m: T-pose offsets of the performer, shape (21, 3); see `CanonicalMotion`.
        anatomy_m: see `landmark_anatomy`; the same for all cameras.
        rng: this camera's own stream.
        hands: the hand network of the same camera.
        head: the performer's head.
        face: this camera's errors of faces.
    """

    def __init__(
        self,
        T_stage_camera: NDArray[np.float64],
        lens: Lens,
        body_m: NDArray[np.float64],
        anatomy_m: NDArray[np.float64],
        rng: np.random.Generator,
        hands: HandTracker,
        head: SimulatedHead,
        face: FaceErrors,
    ) -> None:
        self._T_camera_stage, self._eye = invert_transform(T_stage_camera), T_stage_camera[:3, 3]
        self._lens, self._body, self._anatomy, self._rng = lens, body_m, anatomy_m.copy(), rng
        self._anatomy[FACE] += (head.seen_size - 1.0) * PLACES[FACE]
        self._hands, self._head, self._face = hands, head, face
        legs = sum(np.linalg.norm(body_m[INDEX[f"left_{name}"]]) for name in ("knee", "ankle"))
        self._guess_scale = _STATURE_M * 0.49 / float(legs) * (1.0 + 0.03 * rng.normal())
        self._shift, self._noise = rng.normal(size=(2, _COUNT, 3))
        self._turn = rng.normal(size=3)
        self._off_left, self._off_m = np.zeros(_COUNT, dtype=np.int64), np.zeros((_COUNT, 3))
        self._exchanged_left = np.zeros(1, dtype=np.int64)

    def see(self, joints_m: NDArray[np.float64], time_s: float) -> SeenPicture | None:
        """Return the next frame; None where the picture shows nobody.

        Args:
            joints_m: true joint centres in the stage frame at the frame's instant, shape (21, 3).
            time_s: of the frame.
        """
        hands = self._hands.see(joints_m, time_s)
        rng = self._rng  # every frame draws equally many numbers, whatever its content
        for state, kept in ((self._shift, _SHIFT_AR), (self._noise, _NOISE_AR), (self._turn, _SHIFT_AR)):
            state[:] = kept * state + np.sqrt(1.0 - kept**2) * rng.normal(size=state.shape)
        draw, way, reach = rng.random(_COUNT), rng.normal(size=(_COUNT, 3)), rng.uniform(0.05, 0.2, _COUNT)
        began = _burst(self._off_left, _OUTLIERS, 1.0, rng)
        self._off_m[began] = (way * (reach / np.linalg.norm(way, axis=1))[:, None])[began]
        behind = _FROM_BEHIND if self._sees_back(joints_m) else 1.0
        _burst(self._exchanged_left, _EXCHANGES, behind, rng)
        hidden = hidden_joints(joints_m[None], self._eye)[0][JOINT_OF]
        times = np.where(hidden, _HIDDEN_TIMES, 1.0)[:, None]
        true = self._landmarks(joints_m, time_s, times)
        seen = true + times * (_SIZE[:, :1] * self._shift + _SIZE[:, 1:] * self._noise)
        seen[FACE] += times[FACE] * self._face.next_m()
        seen = np.where((self._off_left > 0)[:, None], true + self._off_m, seen)
        local = seen @ self._T_camera_stage[:3, :3].T + self._T_camera_stage[:3, 3]
        inside = local[:, 2] > 0.2
        pixels = np.where(
            inside[:, None], self._lens.pixels_of(np.where(inside[:, None], local, 1.0)), np.nan
        )
        inside &= ((pixels > 0.0) & (pixels < [WIDTH, HEIGHT])).all(axis=1)
        if inside.mean() < _LEAST_INSIDE:
            return None
        visibility = np.where(hidden, 0.1 + 0.6 * draw, 0.85 + 0.15 * draw) * np.where(inside, 1.0, 0.3)
        world_m = self._guess(true, draw)
        if self._exchanged_left[0] > 0:
            pixels, visibility, world_m = pixels[_MIRROR], visibility[_MIRROR], world_m[_MIRROR]
            hands = hands[::-1]
        return SeenPicture(pixels, visibility, world_m, hands)

    def _landmarks(
        self, joints_m: NDArray[np.float64], time_s: float, times: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Landmarks before errors [m], shape (33, 3); raises the error factors `times` of those behind the skull."""
        straight = self._head.straight(joints_m)
        head = straight @ self._head.glance(time_s)
        true, guessed = landmarks_of(
            np.array([joints_m] * 2), self._body, self._anatomy, np.array([head, straight])
        )
        behind = hidden_by_skull(PLACES[FACE], head, self._eye - joints_m[INDEX["head"]])
        true[FACE][behind] += _BEHIND_GUESS * (guessed - true)[FACE][behind]
        times[FACE][behind] *= _BEHIND_TIMES
        return true

    def _sees_back(self, joints: NDArray[np.float64]) -> bool:
        left = joints[INDEX["left_shoulder"]] - joints[INDEX["right_shoulder"]]
        to_eye = self._eye - joints[INDEX["hips"]]
        return bool(left[1] * to_eye[0] - left[0] * to_eye[1] < 0.0)

    def _guess(self, true: NDArray[np.float64], draw: NDArray[np.float64]) -> NDArray[np.float64]:
        local = true @ self._T_camera_stage[:3, :3].T
        hips = local[[NAMES.index("left_hip"), NAMES.index("right_hip")]].mean(axis=0)
        body = (local - hips) * self._guess_scale
        body[:, 2] = _FLAT * body[:, 2] + _DEPTH_SD_M * self._shift[:, 2]
        a, b, c = _TURN_SD * self._turn
        turn = np.array([[1.0, -c, b], [c, 1.0, -a], [-b, a, 1.0]])
        return body @ turn.T + 0.01 * (draw[:, None] - 0.5)


def _burst(
    left: NDArray[np.int64], how: tuple[float, int, int], times: float, rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Return which bursts begin in this frame; update `left`, the number of remaining frames of each."""
    share, shortest, longest = how
    share = min(share * times, 0.5)
    starts = rng.random(len(left)) < share / ((1.0 - share) * 0.5 * (shortest + longest))
    lengths = rng.integers(shortest, longest + 1, len(left))
    left[:] = np.maximum(left - 1, 0)
    starts &= left == 0
    left[starts] = lengths[starts]
    return starts
