"""A hand network's errors on true hands, for `studio simulate --tracker rgb`.

Sizes are those that its authors give (F. Zhang et al., "MediaPipe Hands", arXiv 2006.10214: a tenth of the palm's
size) and those of the pose network:
- an offset fixed in the hand, shifts of each landmark and of the whole hand that last a second, and noise from
  frame to frame, all as shares of the hand's length;
- three times the shift and noise of a landmark that another finger or the palm hides;
- a quarter of the hands is missed, in bursts of 1 to 8 frames, more where the hand itself is hidden; 2 % are turned
  and off by centimetres, in bursts of 1 to 5;
- hands of fewer than 60 pixels are never found.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform
from studio.engine.model.cameras.lens import Lens
from studio.engine.model.joints import INDEX
from studio.simulator.joints.occlusion import hidden_joints, segment_distance
from studio.simulator.landmarks.fingers import LANDMARKS, STREAM, SimulatedHands

Array = NDArray[np.float64]

LEAST_PIXELS = 60.0
_SHIFT, _WHOLE, _NOISE, _PIXELS = 0.025, 0.02, 0.018, 0.7
_SHIFT_AR, _NOISE_AR = 0.967, 0.4
_HIDDEN_TIMES = 3.0
_MISSED, _MISSED_FRAMES = 0.25, (1, 8)
_WRONG, _WRONG_FRAMES = 0.02, (1, 5)
_SIDES = ("left", "right")
_FINGER_M, _BEFORE_M = 0.008, 0.015
_BONES = np.array(
    [(0 if k == 0 else 4 * f + k, 1 + 4 * f + k) for f in range(5) for k in range(4)]
    + [(5, 9), (9, 13), (13, 17)]
)
_OWN = np.array(
    [
        [row == 0 or row in bone or (n < 20 and n // 4 == (row - 1) // 4) for n, bone in enumerate(_BONES)]
        for row in range(LANDMARKS)
    ]
)
"""Bones that never hide a landmark: its finger's and those that end at it, all for the wrist; shape (21, 23)."""


class HandTracker:
    """One camera's hand network. It is stateful: frames must be given in order, at about 30 Hz.

    Args:
        T_stage_camera: the camera's pose, 4x4.
        lens: the camera's lens.
        hands: the performer's true hands.
        seed, camera: the stage's seed and the camera's number, which seed all noise.
    """

    def __init__(
        self, T_stage_camera: Array, lens: Lens, hands: SimulatedHands, *, seed: int, camera: int
    ) -> None:
        rng = np.random.default_rng([seed, STREAM, 1 + camera])
        self._T_camera_stage, self._eye = invert_transform(T_stage_camera), T_stage_camera[:3, 3]
        self._lens, self._hands, self._rng = lens, hands, rng
        self._shift, self._noise = rng.normal(size=(2, 2, LANDMARKS, 3))
        self._whole = rng.normal(size=(2, 1, 3))
        self._missed_left, self._wrong_left = np.zeros(2, dtype=np.int64), np.zeros(2, dtype=np.int64)
        self._wrong_turn = np.zeros(2)

    def see(self, joints_m: Array, time_s: float) -> Array:
        """Return the hands in the next frame, pixels, left then right, shape (2, 21, 2); NaN = not seen.

        Args:
            joints_m: true joint centres in the stage frame at the frame's instant, shape (21, 3).
            time_s: of the frame.
        """
        rng = self._rng  # every frame draws equally many numbers, whatever its content
        states = ((self._shift, _SHIFT_AR), (self._whole, _SHIFT_AR), (self._noise, _NOISE_AR))
        for state, kept in states:
            state[:] = kept * state + np.sqrt(1.0 - kept**2) * rng.normal(size=state.shape)
        pixels_off, draw = rng.normal(0.0, _PIXELS, (2, LANDMARKS, 2)), rng.random(2)
        _burst(self._missed_left, _MISSED, _MISSED_FRAMES, rng)
        began = _burst(self._wrong_left, _WRONG, _WRONG_FRAMES, rng)
        turns = rng.choice([-1.0, 1.0], 2) * rng.uniform(0.7, 2.0, 2)
        self._wrong_turn[began] = turns[began]
        found = self._found(joints_m, draw)
        out = np.full((2, LANDMARKS, 2), np.nan)
        if not found:
            return out
        true = self._hands.points(joints_m, time_s)
        for k in found:
            times = np.where(hidden_in_hand(true[k], self._eye), _HIDDEN_TIMES, 1.0)[:, None]
            off = self._hands.seen_off[k] + times * (_SHIFT * self._shift[k] + _NOISE * self._noise[k])
            seen = true[k] + self._hands.length_m * (off + _WHOLE * self._whole[k])
            local = seen @ self._T_camera_stage[:3, :3].T + self._T_camera_stage[:3, 3]
            if (local[:, 2] < 0.2).any():
                continue
            pixels = self._lens.pixels_of(local) + pixels_off[k]
            if self._wrong_left[k] > 0:
                c, s = np.cos(self._wrong_turn[k]), np.sin(self._wrong_turn[k])
                middle = pixels.mean(axis=0)
                pixels = (
                    (pixels - middle) @ np.array([[c, s], [-s, c]]) + middle + 20.0 * self._whole[k, 0, :2]
                )
            inside = ((pixels > 0.0) & (pixels < [self._lens.width, self._lens.height])).all(axis=1)
            if inside.mean() > 0.7:
                out[k] = pixels
        return out

    def _found(self, joints_m: Array, draw: Array) -> list[int]:
        """Return the hands that are large enough in the picture and neither hidden nor missed; 0 = left."""
        wrists = [joints_m[INDEX[f"{side}_wrist"]] for side in _SIDES]
        large = [
            k
            for k, wrist in enumerate(wrists)
            if self._missed_left[k] == 0 and self.hand_pixels(wrist) >= LEAST_PIXELS
        ]
        if not large:
            return []
        hidden = hidden_joints(joints_m[None], self._eye)[0]
        ends = {k: [hidden[INDEX[f"{_SIDES[k]}_{end}"]] for end in ("wrist", "hand")] for k in large}
        return [k for k in large if not (all(ends[k]) or (any(ends[k]) and draw[k] < 0.7))]

    def hand_pixels(self, wrist_m: Array) -> float:
        """Return the length of a stretched hand in the picture [pixels] for a wrist position; 0 = behind."""
        depth = float(self._T_camera_stage[2, :3] @ wrist_m + self._T_camera_stage[2, 3])
        return self._lens.fx * self._hands.length_m / depth if depth > 0.2 else 0.0


def hidden_in_hand(points: Array, eye: Array) -> NDArray[np.bool_]:
    """Return which landmarks of a hand, shape (21, 3), are hidden by other fingers or the palm, shape (21,)."""
    way = points - eye
    length = np.linalg.norm(way, axis=1, keepdims=True)
    sight = way * np.maximum(1.0 - _BEFORE_M / length, 0.0)
    start, bone = points[_BONES[:, 0]], points[_BONES[:, 1]] - points[_BONES[:, 0]]
    distance = segment_distance(eye, sight[:, None], start[None], bone[None])
    return np.logical_or.reduce((distance < _FINGER_M) & ~_OWN, axis=1)


def _burst(
    left: NDArray[np.int64], share: float, frames: tuple[int, int], rng: np.random.Generator
) -> NDArray[np.bool_]:
    """Return which bursts begin in this frame; update `left`, the number of remaining frames of each."""
    starts = rng.random(len(left)) < share / ((1.0 - share) * 0.5 * sum(frames))
    lengths = rng.integers(frames[0], frames[1] + 1, len(left))
    left[:] = np.maximum(left - 1, 0)
    starts &= left == 0
    left[starts] = lengths[starts]
    return starts
