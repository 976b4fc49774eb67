"""Prediction of the next frame from the last pose and velocity, with the uncertainty of each joint."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.seeing.fitting.chain import ROOT_DOFS, Limits, Pose
from studio.engine.seeing.fitting.fit import Prior

Array = NDArray[np.float64]

_PER_FRAME_S = 1.0 / 30.0
_ROOT_MOVE, _ROOT_TURN = 0.05, 0.10
_CHANGE = {"Spine": 0.05, "Neck": 0.15, "Shoulder": 0.05, "Arm": 0.35, "ForeArm": 0.40, "Hand": 0.20,
           "UpLeg": 0.20, "Leg": 0.25, "Foot": 0.15, "ToeBase": 0.10}  # fmt: skip
"""Standard deviation of a joint from its prediction, per frame of 1/30 s [rad]; large for the arms."""
_KEPT_VELOCITY = 0.8
_HEADING = 5
"""Index of the turn about the vertical. A turning body keeps turning, and a body seen from the side shows its heading
badly. The angular velocity is therefore smoothed but not damped, so that the body turns past the profile view.
"""
_HEADING_CHANGE, _SMOOTHED = 0.03, 0.7
"""Standard deviation of the heading per frame [rad]; share of the earlier velocity that is kept."""
_POSTURE_SPREAD = 2.0
"""Standard deviation of a posture from rest if there are no points, in usual spreads."""


class PosePredictor:
    """Predicts poses by a Kalman filter with diagonal covariance."""

    def __init__(self, limits: Limits) -> None:
        families = [name.split("_")[0].removeprefix("Left").removeprefix("Right") for name in limits.names]
        self._change = np.concatenate(
            [np.full(3, _ROOT_MOVE), np.full(3, _ROOT_TURN), [_CHANGE[family] for family in families]]
        )
        self._begun = self._change**2
        self._change[_HEADING] = _HEADING_CHANGE
        self._kept = np.where(np.arange(len(self._change)) == _HEADING, 1.0, _KEPT_VELOCITY)
        self._most = np.concatenate([np.full(3, 0.5), np.full(3, 1.0), 2.0 * limits.spread])
        self._limits = limits
        self.posture = np.concatenate([np.zeros(ROOT_DOFS), 1.0 / (_POSTURE_SPREAD * limits.spread) ** 2])
        self.pose: Pose | None = None
        self._updates = 0
        self.velocity = np.zeros(len(self._change))
        self.variance = self._most**2
        self.covariance = np.diag(self.variance)

    def restart(self, pose: Pose) -> None:
        """Restart at a pose with zero velocity."""
        self.pose = pose
        self.velocity = np.zeros(len(self._change))
        self.variance = self._begun
        self.covariance = np.diag(self.variance)
        self._updates = 0

    def after(self, seconds: float) -> Pose:
        """Return the pose predicted by the velocity."""
        assert self.pose is not None
        return self.pose.moved(self.velocity * seconds * self._kept, self._limits)

    def prior(self, seconds: float) -> Prior:
        """Return the prior after `seconds`."""
        share = min(max(seconds / _PER_FRAME_S, 0.3), 10.0)
        variance = np.minimum(self.variance + share * self._change**2, self._most**2)
        return Prior(self.after(seconds), 1.0 / variance, self.posture)

    def update(self, pose: Pose, information: Array, seconds: float) -> None:
        """Update with the pose found after `seconds` and its normal matrix."""
        assert self.pose is not None
        step = pose.step_from(self.pose)
        if seconds > 0:
            limit = np.where(np.arange(len(step)) < 3, 8.0, 25.0)
            before = self.velocity[_HEADING]
            self.velocity = np.clip(step / seconds, -limit, limit)
            kept = min(_SMOOTHED, self._updates / (self._updates + 1))
            self.velocity[_HEADING] += kept * (before - self.velocity[_HEADING])
            self._updates += 1
        self.covariance = np.linalg.inv(information)
        self.variance = np.minimum(np.diag(self.covariance), self._most**2)
        self.pose = pose
