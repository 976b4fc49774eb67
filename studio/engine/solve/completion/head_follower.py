"""A head that follows the landmarks of its face: an iterated Kalman filter of its orientation, and its smoother.

The face is rigid (`human.face`); its size is estimated. Its place is the body's plus a shift. The state is relative
to a head that looks straight ahead, to which an unseen head returns. A filter's frames can be smoothed afterwards
(Rauch, Tung, Striebel, AIAA J. 3, 1965), on the tangent of the expected rotation.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.face import EARS, LANDMARKS, MIRROR, PLACES_M
from studio.engine.solve.completion.head_kernels import (
    ACROSS_M,
    SHIFT,
    SIZE,
    STATE,
    TURN,
    corrected,
    face_points,
    missed_m,
    turn_between,
    turned_by,
)

Array = NDArray[np.float64]

BACK_S = 1.0
"""Time constant with which an unseen head returns to looking straight ahead [s]."""

FORGET_S = 3.0
"""A head that no camera has seen for this long is no longer followed."""

EXCHANGED_SHARE = 0.6
"""A camera has exchanged left and right if undoing it reduces its rays' distance from the face to this share."""

FAR_M = 0.1
"""A camera whose rays miss the face by more than this on average sees another one."""

ALONE_TIMES = 1.5
"""Factor of a landmark's error where only one camera sees the face: no other separates errors of the whole face from
turns."""

_TURNS, _SHIFT_M, _SIZE = np.radians([22.0, 12.0, 40.0]), 0.03, 0.25
SPREADS = np.array([*_TURNS, *[_SHIFT_M] * 3, _SIZE])
"""Usual distance of the state from a head that looks straight ahead, shape (STATE,): nodding, tilting, turning."""

_PLACES = np.ascontiguousarray(PLACES_M)
_EARS = np.array(EARS)


@dataclass(frozen=True)
class HeadState:
    """A head's rotation from looking straight ahead, 3x3, the shift of its place [m], and the size's logarithm."""

    turn: Array
    shift: Array
    size: float

    def moved(self, error: Array) -> "HeadState":
        """Return the state after an error, shape (STATE,)."""
        return HeadState(
            turned_by(error[TURN], self.turn), self.shift + error[SHIFT], self.size + float(error[SIZE])
        )

    def error_from(self, other: "HeadState") -> Array:
        """Return the error that moves another state to this one, shape (STATE,)."""
        return np.concatenate(
            [turn_between(self.turn, other.turn), self.shift - other.shift, [self.size - other.size]]
        )


STRAIGHT = HeadState(np.eye(3), np.zeros(3), 0.0)


@dataclass(frozen=True)
class HeadStep:
    """A frame of a filter: state and covariance before and after the rays, and the share of the state that stayed."""

    expected: HeadState
    before: Array
    state: HeadState
    after: Array
    stays: Array


class HeadFollower:
    """Follows a head, frame by frame."""

    def __init__(self) -> None:
        self._last: HeadStep | None = None
        self._size, self._size_variance = 0.0, _SIZE**2
        self._unseen_s = 0.0

    def follow(
        self, straight: Array, place: Array, rays: Array | None, centres: Array, dt: float
    ) -> HeadStep | None:
        """Return the head in the next frame; None = it is not followed.

        Args:
            straight: world rotation of a head that looks straight ahead, 3x3.
            place: the body's place of the middle of the ears [m], shape (3,).
            rays: points on the rays of the face's landmarks, shape (camera_count, 11, 3) [m], NaN = unseen; None =
                none is seen.
            centres: of the cameras [m], shape (camera_count, 3).
            dt: time since the last frame [s].
        """
        if rays is None and self._last is None:
            return None
        expected, before, stays = self._predicted(dt)
        used, directions, eyes = 0, np.empty((0, LANDMARKS, 3)), np.empty((0, 3))
        if rays is not None:
            directions, eyes = _on_head(straight, place, rays, centres)
            directions = _sorted_rays(directions, eyes, expected)
            used = int((~np.isnan(directions[:, :, 0])).any(axis=1).sum())
        self._unseen_s = 0.0 if used else self._unseen_s + dt
        if self._unseen_s > FORGET_S or (self._last is None and not used):
            self._last = None
            return None
        state, after = expected, before
        if used:
            across_m = ACROSS_M if used > 1 else ALONE_TIMES * ACROSS_M
            *found, after = corrected(
                expected.turn, expected.shift, expected.size, before, directions, eyes, _PLACES, _EARS, across_m
            )  # fmt: skip
            state = HeadState(*found)
            self._size, self._size_variance = state.size, float(after[SIZE, SIZE])
        self._last = HeadStep(expected, before, state, after, stays)
        return self._last

    def _predicted(self, dt: float) -> tuple[HeadState, Array, Array]:
        """State and covariance before the rays, and the share of the last state in it, shape (STATE,)."""
        if self._last is None:
            spread = SPREADS**2
            spread[SIZE] = self._size_variance
            return HeadState(np.eye(3), np.zeros(3), self._size), np.diag(spread), np.zeros(STATE)
        last, stay = self._last.state, math.exp(-dt / BACK_S)
        stays = np.full(STATE, stay)
        stays[SIZE] = 1.0
        error = last.error_from(STRAIGHT)
        covariance = self._last.after * stays * stays[:, None] + np.diag((1.0 - stays**2) * SPREADS**2)
        return STRAIGHT.moved(stays * error), np.ascontiguousarray(covariance), stays


def _on_head(straight: Array, place: Array, rays: Array, centres: Array) -> tuple[Array, Array]:
    """Unit directions of the rays, shape (camera_count, 11, 3), and the cameras, shape (camera_count, 3), in the axes
    of a head that looks straight ahead, from its place."""
    directions = rays - centres[:, None]
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    return np.ascontiguousarray(directions @ straight), np.ascontiguousarray((centres - place) @ straight)


def _sorted_rays(rays: Array, centres: Array, expected: HeadState) -> Array:
    """The rays, with a camera's left and right exchanged where that fits better; NaN where they show another face."""
    points = face_points(expected.turn, expected.shift, expected.size, _PLACES)
    out = np.full((len(rays), LANDMARKS, 3), np.nan)
    for c, centre in enumerate(centres):
        own, other = (missed_m(points, one, centre) for one in (rays[c], rays[c][MIRROR]))
        if other < EXCHANGED_SHARE * own:
            own, out[c] = other, rays[c][MIRROR]
        else:
            out[c] = rays[c]
        if own > FAR_M:
            out[c] = np.nan
    return out


def smoothed(steps: list[HeadStep]) -> list[HeadState]:
    """Return the states of consecutive frames, smoothed with the later ones."""
    out = [steps[-1].state]
    for step, after in zip(steps[-2::-1], steps[:0:-1], strict=True):
        gain = np.linalg.solve(after.before, after.stays[:, None] * step.after).T
        out.append(step.state.moved(gain @ out[-1].error_from(after.expected)))
    return out[::-1]
