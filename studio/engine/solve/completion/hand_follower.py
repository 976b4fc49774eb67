"""One hand that follows its landmarks: an iterated Kalman filter of its state (`human.hand`), and its smoother.

Between pictures the state drifts back to what the body and the hand states say, so that a hand that is no longer seen
comes to rest. A filter's frames can be smoothed afterwards (Rauch, Tung, Striebel, AIAA J. 3, 1965).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.hand import HINGES, SHIFT, SIZE, STATE, WRIST, HandModel
from studio.engine.solve.completion.finger_kernels import (
    COLD_ROUNDS,
    ROUNDS,
    corrected,
    hand_points,
    missed_m,
)

Array = NDArray[np.float64]

BACK_S = 0.4
"""Time constant with which the state returns to what the body says [s]."""

FORGET_S = 3.0
"""A hand that no camera has seen for this long is no longer followed."""

PALM = [0, 5, 9, 13, 17]
"""Landmarks of the wrist and the fingers' knuckles."""

FAR_M = 0.12
"""A camera whose rays miss the body's palm by more than this on average sees another hand, or none."""

LOST_M, FOUND_SHARE = 0.02, 0.8
"""A hand that the rays miss by more than this on average is fitted again from what the body says. The new fit is
taken if it reduces the distance to this share."""

_SHIFT_M, _TWIST, _BENDS, _SIZE = 0.04, math.radians(50.0), math.radians(12.0), 0.1
_ACROSS, _CLOSING, _THUMB = math.radians(8.0), math.radians(45.0), math.radians(22.0)


def _spreads() -> Array:
    """Usual distance of the state from what the body says, shape (STATE,)."""
    out = np.empty(STATE)
    out[SHIFT], out[WRIST], out[SIZE] = _SHIFT_M, (_TWIST, _BENDS, _BENDS), _SIZE
    out[HINGES] = [_THUMB] * 4 + [_CLOSING, _ACROSS, _CLOSING] * 4
    return out


SPREADS = _spreads()
_UNMOVED = np.arange(STATE) == SIZE


@dataclass(frozen=True)
class Arm:
    """What the body says about a hand.

    Attributes:
        forearm: the forearm's world rotation without its twist, 3x3.
        wrist_m: place of the wrist, stage frame, shape (3,).
        resting: the hand's state according to body and hand states, shape (STATE,).
    """

    forearm: Array
    wrist_m: Array
    resting: Array


@dataclass(frozen=True)
class HandStep:
    """A frame of a filter: state and covariance before and after the rays, and the share of the state that stayed."""

    expected: Array
    before: Array
    state: Array
    after: Array
    stays: Array


class HandFollower:
    """Follows one hand, frame by frame.

    Attributes:
        model: the hand.
        last: the last frame; None = not followed.
    """

    def __init__(self, model: HandModel) -> None:
        self.model = model
        self.last: HandStep | None = None
        self._chain = (model.offsets_m, model.axes, model.places, model.ratios, model.wrist_axes)
        self._size, self._size_variance = 0.0, _SIZE**2
        self._unseen_s = 0.0

    def resting_points(self, arm: Arm) -> Array:
        """Return the hand's landmarks according to the body [m], shape (21, 3)."""
        return hand_points(arm.resting, arm.forearm, arm.wrist_m, *self._chain)[0]

    def follow(self, arm: Arm, rays: Array, centres: Array, dt: float) -> HandStep | None:
        """Return the hand in the next frame; None = it is not followed.

        Args:
            arm: what the body says.
            rays: unit directions of the landmarks, shape (camera_count, 21, 3); NaN = unseen.
            centres: of the cameras [m], shape (camera_count, 3).
            dt: time since the last frame [s].
        """
        seen = ~np.isnan(rays[:, :, 0]).all()
        self._unseen_s = 0.0 if seen else self._unseen_s + dt
        if self._unseen_s > FORGET_S or (self.last is None and not seen):
            self.last = None
            return None
        expected, before, stays = self._predicted(arm, dt)
        state, after = expected, before
        if seen:
            rounds = COLD_ROUNDS if self.last is None else ROUNDS
            state, after, missed = self._corrected(expected, before, arm, rays, centres, rounds)
            if missed > LOST_M and self.last is not None:
                self.last = None
                anew = self._predicted(arm, dt)
                found = self._corrected(*anew[:2], arm, rays, centres, COLD_ROUNDS)
                if found[2] < FOUND_SHARE * missed:
                    (expected, before, stays), (state, after, _) = anew, found
            self._size, self._size_variance = float(state[SIZE]), float(after[SIZE, SIZE])
        self.last = HandStep(expected, before, state, after, stays)
        return self.last

    def _corrected(
        self, expected: Array, before: Array, arm: Arm, rays: Array, centres: Array, rounds: int
    ) -> tuple[Array, Array, float]:
        return corrected(
            expected, before, rays, centres, arm.forearm, arm.wrist_m, *self._chain,
            self.model.low, self.model.high, rounds,
        )  # fmt: skip

    def _predicted(self, arm: Arm, dt: float) -> tuple[Array, Array, Array]:
        """State and covariance before the rays, and the share of the last state in it, shape (STATE,)."""
        resting = arm.resting.copy()
        resting[SIZE] = self._size
        if self.last is None:
            spread = SPREADS**2
            spread[SIZE] = self._size_variance
            return resting, np.diag(spread), np.zeros(STATE)
        stays = np.where(_UNMOVED, 1.0, math.exp(-dt / BACK_S))
        expected = resting + stays * (self.last.state - resting)
        covariance = self.last.after * stays * stays[:, None] + np.diag((1.0 - stays**2) * SPREADS**2)
        return expected, covariance, stays


def smoothed(steps: list[HandStep]) -> list[Array]:
    """Return the states of consecutive frames, smoothed with the later ones."""
    out = [steps[-1].state]
    for step, after in zip(steps[-2::-1], steps[:0:-1], strict=True):
        gain = np.linalg.solve(after.before, after.stays[:, None] * step.after).T
        out.append(step.state + gain @ (out[-1] - after.expected))
    return out[::-1]


def sorted_rays(rays: Array, centres: Array, expected: tuple[Array, Array]) -> NDArray[np.float64]:
    """Return the rays of each hand that fit it: a camera may exchange left and right, or see something else.

    Args:
        rays: unit directions, shape (camera_count, 2, 21, 3); NaN = unseen.
        centres: of the cameras [m], shape (camera_count, 3).
        expected: landmarks of the left and the right hand by the body [m], shape (21, 3) each.
    """
    out = np.full(rays.shape, np.nan)
    for c, centre in enumerate(centres):
        for side, points in enumerate(expected):
            own, other = (missed_m(points[PALM], rays[c, k][PALM], centre) for k in (side, 1 - side))
            if own < FAR_M:
                out[c, side] = rays[c, side]
            elif other < FAR_M and other < 0.5 * own:
                out[c, side] = rays[c, 1 - side]
    return out
