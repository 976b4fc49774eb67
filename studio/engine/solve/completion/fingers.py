"""Fingers that follow the hands that ordinary cameras see: live frame by frame, and smoothed over a whole take."""

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import FrameSet
from studio.engine.model.human.hand import HINGES, SIDES, STATE, WRIST, HandModel
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.completion.finger_kernels import turn_hand
from studio.engine.solve.completion.hand_follower import Arm, HandFollower, HandStep, sorted_rays
from studio.engine.solve.completion.hands import Hands

Array = NDArray[np.float64]

HandStates: TypeAlias = list[Array | None]
"""States of the left and the right hand (`human.hand`), shape (STATE,); None = not followed."""


def hand_models(skeleton: Skeleton, settings: SolveSettings) -> tuple[HandModel, HandModel]:
    """Return the left and the right hand of a performer."""
    limited = settings.human_limits == "on"
    left, right = (
        HandModel.of(skeleton, side, limited=limited, flexibility=settings.flexibility) for side in SIDES
    )
    return left, right


class Fingers:
    """Follows both hands and turns forearms, hands and fingers."""

    def __init__(self, models: tuple[HandModel, HandModel]) -> None:
        self._models = models
        self._followers = tuple(HandFollower(model) for model in models)

    def follow(
        self, positions: Array, rotations: Array, frames: FrameSet, hands: Hands | None, dt: float
    ) -> list[HandStep | None]:
        """Return both hands in the next frame; None = a hand is not followed.

        Args:
            positions: of the output joints by the body [m], shape (52, 3).
            rotations: world rotations of the output joints, shape (52, 3, 3), fingers' unset.
            frames: the cameras' frames.
            hands: fingers of the hand states, to which unseen fingers return; None = straight.
            dt: time since the last frame [s].
        """
        rays = frames.hand_rays
        if rays is None and all(one.last is None for one in self._followers):
            return [None, None]
        arms = [arm_of(model, positions, rotations, hands) for model in self._models]
        centres = frames.camera_positions
        if rays is None:
            directions = np.full((len(centres), 2, 21, 3), np.nan)
        else:
            directions = rays - centres[:, None, None]
            directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
            left, right = (one.resting_points(arm) for one, arm in zip(self._followers, arms, strict=True))
            directions = sorted_rays(directions, centres, (left, right))
        return [
            one.follow(arm, np.ascontiguousarray(directions[:, k]), centres, dt)
            for k, (one, arm) in enumerate(zip(self._followers, arms, strict=True))
        ]

    def follow_states(
        self, positions: Array, rotations: Array, frames: FrameSet, hands: Hands | None, dt: float
    ) -> HandStates:
        """Return both hands' states in the next frame; see `follow`."""
        steps = self.follow(positions, rotations, frames, hands, dt)
        return [None if step is None else step.state for step in steps]

    def turn(self, rotations: Array, states: HandStates) -> None:
        """Turn forearms, hands and fingers to both hands' states, in place; None = a hand is left as it is."""
        for model, state in zip(self._models, states, strict=True):
            if state is not None:
                upper, fore, hand = model.arm
                base = untwisted(rotations[upper], rotations[fore])[0]
                turn_hand(
                    rotations, np.clip(state, model.low, model.high), base, fore, hand, model.joints,
                    model.axes, model.places, model.ratios, model.wrist_axes,
                )  # fmt: skip


def untwisted(upper: Array, forearm: Array) -> tuple[Array, float]:
    """Return the forearm's world rotation without its twist, 3x3, and the twist [rad].

    Args:
        upper: world rotation of the upper arm, 3x3.
        forearm: of the forearm, 3x3.
    """
    local = upper.T @ forearm
    twist = math.atan2(local[2, 1], local[2, 2])
    s, c = math.sin(twist), math.cos(twist)
    return forearm @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]]), twist


def arm_of(model: HandModel, positions: Array, rotations: Array, hands: Hands | None) -> Arm:
    """Return what the body and the hand states say about a hand; args as for `Fingers.follow`."""
    upper, fore, hand = model.arm
    base, twist = untwisted(rotations[upper], rotations[fore])
    turn = rotations[fore].T @ rotations[hand]
    sign = model.wrist_axes[1, 1]  # the right hand's axes are mirrored
    resting = np.zeros(STATE)
    resting[WRIST] = (
        twist,
        sign * math.atan2(turn[0, 2], turn[2, 2]),
        sign * math.atan2(turn[1, 0], turn[1, 1]),
    )
    if hands is not None:
        bends = hands.bends_rad(0 if sign > 0 else 1)
        resting[HINGES] = [0.0, *bends[:, 0], *np.insert(bends[:2, 1:], 1, 0.0, axis=0).T.ravel()]
    return Arm(base, positions[hand], resting)
