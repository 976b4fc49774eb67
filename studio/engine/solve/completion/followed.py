"""Hands and head that follow what ordinary cameras see of them, frame by frame or smoothed over a whole take."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import FrameSet
from studio.engine.model.human.hand import SIDES
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.completion import hand_follower, head_follower
from studio.engine.solve.completion.fingers import Fingers, HandStates, hand_models
from studio.engine.solve.completion.hand_follower import HandStep
from studio.engine.solve.completion.hands import Hands
from studio.engine.solve.completion.head_follower import HeadFollower, HeadStep
from studio.engine.solve.completion.look_at import LookAt

Array = NDArray[np.float64]
Step = TypeVar("Step")
State = TypeVar("State")

_HEAD = OUTPUT_INDEX["Head"]


@dataclass(frozen=True)
class Followed:
    """States of both hands, and how the head is turned from looking straight ahead, 3x3; None = not followed."""

    hands: HandStates
    head: Array | None


def follow_head(
    follower: HeadFollower, look_at: LookAt, positions: Array, rotations: Array, frames: FrameSet, dt: float
) -> HeadStep | None:
    """Return the head in the next frame; None = it is not followed. Args as of `FollowedSmoother.add`."""
    straight = look_at.straight(rotations)
    return follower.follow(straight, positions[_HEAD], frames.face_rays, frames.camera_positions, dt)


class FollowedSmoother:
    """Hands and head over a whole take: `add` each frame, then take the oldest frames with `smoothed`."""

    def __init__(self, skeleton: Skeleton, settings: SolveSettings) -> None:
        self._fingers = None
        if settings.fingers == "on":
            self._fingers = Fingers(hand_models(skeleton, settings))
        self._hands = None
        if settings.hands != "off":
            self._hands = Hands(settings.hands, flexibility=settings.flexibility)
        look_at = LookAt.of(settings)
        self._look_at = look_at if look_at is not None and look_at.measures else None
        self._head = HeadFollower()
        self._hand_steps: list[list[HandStep | None]] = []
        self._head_steps: list[HeadStep | None] = []

    def add(self, positions: Array, rotations: Array, frames: FrameSet, dt: float) -> None:
        """Add a frame.

        Args:
            positions: of the output joints by the body [m], shape (52, 3).
            rotations: world rotations of the output joints, shape (52, 3, 3), fingers' unset.
            frames: the cameras' frames.
            dt: time since the last frame [s].
        """
        if self._hands is not None:
            self._hands.follow(frames.hands, dt)
        hands: list[HandStep | None] = [None, None]
        if self._fingers is not None:
            hands = self._fingers.follow(positions, rotations, frames, self._hands, dt)
        self._hand_steps.append(hands)
        head = None
        if self._look_at is not None:
            head = follow_head(self._head, self._look_at, positions, rotations, frames, dt)
        self._head_steps.append(head)

    def smoothed(self, count: int) -> list[Followed]:
        """Return the oldest frames, smoothed with the later ones, and forget them.

        Args:
            count: number of frames.
        """
        sides = [
            _smoothed_pieces([steps[k] for steps in self._hand_steps], hand_follower.smoothed)[:count]
            for k in range(len(SIDES))
        ]
        heads = _smoothed_pieces(self._head_steps, head_follower.smoothed)[:count]
        del self._hand_steps[:count], self._head_steps[:count]
        return [
            Followed(list(hands), None if head is None else head.turn)
            for head, *hands in zip(heads, *sides, strict=True)
        ]


def _smoothed_pieces(
    steps: list[Step | None], smoothed: Callable[[list[Step]], list[State]]
) -> list[State | None]:
    """Smoothed states; each piece without a missing step is smoothed by itself."""
    out: list[State | None] = []
    piece: list[Step] = []
    for step in [*steps, None]:
        if step is not None:
            piece.append(step)
            continue
        if piece:
            out.extend(smoothed(piece))
            piece = []
        out.append(None)
    return out[: len(steps)]
