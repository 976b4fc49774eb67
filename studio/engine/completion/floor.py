"""Floor contact: feet stay above the floor, and a foot that stands stays where it stands.

Before the solve, `FloorContact.targets` lifts the joints of feet that are under the floor and holds those
that stand; after it, `lift` raises a pose whose feet are still under the floor. A foot is let go as soon as
it rises or moves away from where it was held, so that jumps and slides remain possible.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studio.engine.human.skeleton import Skeleton
from studio.engine.joints import INDEX, OUTPUT_INDEX

STAND_HEIGHT_M = 0.045
"""A standing foot's joints are at most this far above their resting height."""

STAND_SPEED_M_S = 0.30
LEAVE_SPEED_M_S = 0.60
"""A foot stands below the first speed, and leaves above the second."""

LEAVE_M = 0.05
"""A foot this far from where it is held is let go."""

HOLD_S = 0.15
"""Time in which a standing foot is taken hold of, and let go."""

HOLD_SIGMA_M = 0.004
"""Deviation given to a held joint."""

_SPEED_S = 0.06
_FOOT = {side: np.array([INDEX[f"{side}_ankle"], INDEX[f"{side}_toe"]]) for side in ("left", "right")}
_FOOT_OUTPUTS = np.array([OUTPUT_INDEX[n] for n in ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")])


@dataclass
class _Foot:
    anchor: NDArray[np.float64] | None = None  # ankle and toe where the foot stands, (2, 3)
    held: float = 0.0  # 0 = free, 1 = held
    last: NDArray[np.float64] | None = None
    velocity: NDArray[np.float64] = field(default_factory=lambda: np.zeros((2, 3)))


class FloorContact:
    """Holds standing feet, frame by frame."""

    def __init__(self, skeleton: Skeleton) -> None:
        rest = skeleton.rest_positions_m
        self._height = {
            side: np.maximum(rest[[OUTPUT_INDEX[f"{side.capitalize()}Foot"], OUTPUT_INDEX[f"{side.capitalize()}ToeBase"]], 2], 0.0)
            for side in ("left", "right")
        }  # fmt: skip
        self._rest_height = np.concatenate([self._height["left"], self._height["right"]])
        self._feet = {"left": _Foot(), "right": _Foot()}

    def targets(
        self, joints: NDArray[np.float64], sigma: NDArray[np.float64], dt: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return canonical joints [m], shape (21, 3), and deviations, shape (21,), with the feet on the floor."""
        joints, sigma = joints.copy(), sigma.copy()
        for side, foot in self._feet.items():
            rows, height = _FOOT[side], self._height[side]
            here = joints[rows]
            if np.isnan(here).any():
                foot.last = None
                foot.held = max(0.0, foot.held - dt / HOLD_S)
                continue
            here[:, 2] = np.maximum(here[:, 2], height)
            self._follow(foot, here, height, dt)
            if foot.anchor is not None and foot.held > 0.0:
                here = (1.0 - foot.held) * here + foot.held * foot.anchor
                sigma[rows] = (1.0 - foot.held) * sigma[rows] + foot.held * HOLD_SIGMA_M
            joints[rows] = here
        return joints, sigma

    @staticmethod
    def _follow(foot: _Foot, here: NDArray[np.float64], height: NDArray[np.float64], dt: float) -> None:
        """Update whether the foot stands, and how firmly it is held."""
        if foot.last is not None and dt > 0:
            share = 1.0 - np.exp(-dt / _SPEED_S)
            foot.velocity += share * ((here - foot.last) / dt - foot.velocity)
        foot.last = here.copy()
        speed = float(np.linalg.norm(foot.velocity.mean(axis=0)))
        low = bool((here[:, 2] - height < STAND_HEIGHT_M).all())
        if foot.anchor is None:
            if low and speed < STAND_SPEED_M_S:
                foot.anchor = np.column_stack([here[:, :2], height])
        else:
            away = float(np.linalg.norm((here - foot.anchor).mean(axis=0)))
            if not low or speed > LEAVE_SPEED_M_S or away > LEAVE_M:
                foot.held = max(0.0, foot.held - dt / (0.5 * HOLD_S))
                if foot.held == 0.0:
                    foot.anchor = None
            else:
                foot.held = min(1.0, foot.held + dt / HOLD_S)
                foot.anchor[:, :2] += (1.0 - np.exp(-dt / 1.0)) * (here - foot.anchor)[:, :2]

    def lift(self, positions: NDArray[np.float64]) -> float:
        """Return how far a pose, shape (52, 3) [m], has to rise so that no foot is under the floor."""
        return max(0.0, float((self._rest_height - positions[_FOOT_OUTPUTS, 2]).max()))
