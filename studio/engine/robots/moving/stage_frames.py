"""Single poses of the live stage, or of a replay, as a robot needs them."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.performer import bone_offsets, rest_positions
from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.soles import rest_lift_m
from studio.engine.robots.body.robot import Robot
from studio.engine.robots.moving.live import Follower
from studio.engine.robots.moving.performed import CHEST, FEET, HEAD, LIMBS, Performed, limb_lengths

Array = NDArray[np.float64]

MEASURED_EVERY = 30
"""Frames between measurements of the performer: lengths change where a solve does not fix them."""

JUMP_S = 0.3
"""Time after the last pose above which a new motion begins; so does a pose before the last one [s]."""

_JOINTS = ("Hips", *LIMBS, "LeftToeBase", "RightToeBase")
_FLAT = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))


class StageFollower:
    """A robot that follows single poses of the output skeleton, whose floor is at z = 0."""

    def __init__(self, robot: Robot, frame_s: float, *, at_once: bool = True) -> None:
        """Args: `frame_s`: usual time between poses [s]; `at_once`: as in `Follower`."""
        self._robot, self._frame_s, self._at_once = robot, frame_s, at_once
        self._follower = Follower(robot, frame_s, at_once=at_once)
        self._lengths: dict[str, float] = {}
        self._stand = np.zeros(4)
        self._count = 0
        self._last_s: float | None = None

    def follow(
        self,
        positions_m: Array,
        rotations_wxyz: Array,
        root_height_m: float | None,
        time_s: float,
        pace: float = 1.0,
    ) -> Array:
        """Return the robot's configuration, shape (nq,).

        Args:
            positions_m: output joints, stage frame [m], shape (52, 3).
            rotations_wxyz: their world rotations, shape (52, 4).
            root_height_m: height of the hips in the T-pose, where known.
            time_s: time of the pose; after a jump, a robot with `at_once` jumps to the pose.
            pace: share of the velocity limits that the hinges may use.
        """
        jumped = self._last_s is not None and not -1e-6 <= time_s - self._last_s <= JUMP_S
        if jumped and self._at_once:
            self._follower = Follower(self._robot, self._frame_s)
            self._count = 0
        if self._count % MEASURED_EVERY == 0:
            self._measure(positions_m, rotations_wxyz, root_height_m)
        self._count, self._last_s = self._count + 1, time_s
        return self._follower.follow(self._frame(positions_m, rotations_wxyz, time_s), pace)

    def hold(self) -> Array:
        """Return the configuration while there is no performer, shape (nq,): the robot comes to rest."""
        return self._follower.hold()

    def _measure(self, positions: Array, rotations: Array, root_height_m: float | None) -> None:
        rest = rest_positions(bone_offsets(positions, rotations))
        heights = rest[:, 2] + rest_lift_m(rest[:, 2], root_height_m)
        self._stand = heights[[OUTPUT_INDEX[name] for name in FEET]]
        self._lengths = limb_lengths({name: rest[None, OUTPUT_INDEX[name]] for name in _JOINTS})

    def _frame(self, positions: Array, rotations: Array, time_s: float) -> Performed:
        turned = {name: rotations[None, OUTPUT_INDEX[name]] for name in ("Hips", *LIMBS)}
        turned["Chest"] = rotations[None, OUTPUT_INDEX[CHEST[0]]]
        turned["Head"] = rotations[None, OUTPUT_INDEX[HEAD[0]]]
        return Performed(
            time_s=np.array([time_s]),
            frame_s=self._frame_s,
            at={name: positions[None, OUTPUT_INDEX[name]] for name in _JOINTS},
            turned=turned,
            feet_rest=_FLAT,
            hold=np.zeros((1, 4)),
            stand_m=self._stand,
            lengths_m=self._lengths,
        )
