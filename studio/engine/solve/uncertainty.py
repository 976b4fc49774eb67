"""Uncertainty of each joint of a solved pose: the radius of the 90 % ball, per frame.

The truth is not known live. The squared radius is the sum of these squared contributions:

- the **offset**: a device's joint is not the anatomical centre, by about 1 cm per axis, fixed in the bone. No camera
  sees it, so no radius is smaller.
- the **noise** of the cameras that were used, by distance, confidence and joint (`model.joint_noise`), pooled over
  the cameras. It is correlated over about 0.15 s, so filter and solve average out less of it than of white noise.
- the **disagreement** of those cameras with the fused joint beyond their noise: one of them, or the fused joint, is
  wrong. For a camera that may exchange left and right, the nearer side counts.
- the **misfit** between the fused joint and the solved one, due to bone lengths, limits or speed. Some of it is the
  solve's error and some the joint's.
- the **timing**: clocks, interpolation and filters put a moving joint some milliseconds behind or ahead.
- the **time unseen**: an unseen joint is extrapolated and may be wrong by up to the reach of the limb.

The coefficients come from quantile regression (Koenker, Bassett, "Regression quantiles", Econometrica 1978) on two of
four recordings with known truth, the offset held at its known size; see `docs/decisions/0036-uncertainty.md`.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from studio.engine.base.compiled import compiled
from studio.engine.model.cameras.joint_noise import AXIAL_PER_M, JOINT_FACTOR, LATERAL_PER_M, LEAST_DISTANCE_M
from studio.engine.model.frames import FrameSet, FusedSkeleton
from studio.engine.model.joints import (
    CANONICAL,
    INDEX,
    JOINT_COUNT,
    MIRROR,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL_INDEX,
)

BALL_90 = 2.5
"""Radius of the ball with 90 % of a 3D normal distribution, in standard deviations per axis."""

OFFSET_M = 0.01
"""Standard deviation per axis of a device's joint from the anatomical centre, fixed in the bone [m]."""

NOISE_SHARE = 0.9
FILTERED_SHARE = 0.5
SOLVED_SHARE, SOLVED_SHARE_OF_CAMERAS = 0.55, 0.45
"""Share of the cameras' noise that remains: after a fusion that filters over time, and after fitting a body with its
motion prior to fused joints or to the cameras' own. The share of the fit multiplies that of the fusion.
"""

DISAGREEMENT = 1.35
"""Radius per metre of the cameras' distance from the fused joint beyond their noise."""

MISFIT = 1.0
MISFIT_OF_CAMERAS = 0.38
"""Radius per metre between the fused joint and the solved one; the second where the fused joint is not filtered over
time, so that the distance includes its noise.
"""

TIMING_S, TIMING_OF_CAMERAS_S = 0.015, 0.0175
"""Radius per m/s of a joint's speed [s], of a body fitted to fused joints and to the cameras' own."""

UNSEEN_S = 0.3
"""Time for which an unseen joint's radius grows; after it, the body carries the joint."""

ELSEWHERE_M = 0.1
"""A camera further than this from a fused joint may have exchanged left and right."""

_MEMORY_S = np.array([0.15, 0.05, 0.1])
"""Averaging times of the squares of noise, misfit and speed."""

CLOSE_M = 0.05
"""Confidence is the probability of an error below this."""

_GROWTH = {"elbow": 1.0, "knee": 0.8, "wrist": 1.5, "hand": 1.8, "ankle": 1.2, "toe": 1.3}
GROWTH_M_S: NDArray[np.float64] = np.array([_GROWTH.get(name.split("_")[-1], 0.5) for name in CANONICAL])
"""Growth of an unseen joint's radius [m/s]: fast at the ends of limbs, slow in the trunk."""

_OFFSET2 = (BALL_90 * OFFSET_M) ** 2
_AXIAL2 = JOINT_FACTOR**2 * AXIAL_PER_M**2 / 3.0
_LATERAL2 = JOINT_FACTOR**2 * LATERAL_PER_M**2 * 2.0 / 3.0
_SQRT_HALF = float(np.sqrt(0.5))
_TWO_OVER_SQRT_PI = 2.0 / float(np.sqrt(np.pi))

_PHALANX_M = {"1": 0.01, "2": 0.03, "3": 0.045}
"""Radius added by the unmeasured bend of a finger, from its base to its last joint [m]."""


def _shares() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Weights of canonical joints' variances in an output joint's, shape (52, 21), and added variance [m2], (52,).

    A measured joint has its own variance. A spine joint or clavicle between two measured ones has their mean. A
    finger has the hand's, plus that of its unmeasured bend.
    """
    shares, added = np.zeros((len(OUTPUT_JOINTS), JOINT_COUNT)), np.zeros(len(OUTPUT_JOINTS))
    own = {int(output): canonical for canonical, output in enumerate(OUTPUT_OF_CANONICAL_INDEX)}
    for joint, name in enumerate(OUTPUT_JOINTS):
        side = "left" if name.startswith("Left") else "right"
        if joint in own:
            shares[joint, own[joint]] = 1.0
        elif name.endswith("Shoulder"):
            shares[joint, [INDEX["chest"], INDEX[f"{side}_shoulder"]]] = 0.5
        elif name == "Spine":
            shares[joint, [INDEX["hips"], INDEX["spine"]]] = 0.5
        else:
            shares[joint, INDEX[f"{side}_hand"]] = 1.0
            added[joint] = _PHALANX_M[name[-1]] ** 2
    return shares, added


_SHARES, _ADDED = _shares()


def of_output_joints(
    squared_radii: NDArray[np.float64], confidence: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the confidence, 0..1, and the radius [mm] of each output joint, shapes (52,); see `Uncertainty.of`.

    Args:
        squared_radii: of the canonical joints' 90 % balls [m2], shape (21,).
        confidence: of the fused joints, shape (21,); 0 = unseen.
    """
    radius = np.sqrt(_SHARES @ squared_radii + _ADDED)
    within = _probability_within(CLOSE_M * BALL_90 / radius)
    return within * (_SHARES @ confidence > 0.0), 1e3 * radius


class Uncertainty:
    """Radii of the 90 % balls and confidences of a performer's joints, frame by frame."""

    def __init__(self, *, filtered: bool, solved: bool, of_cameras: bool = False) -> None:
        """Start without any frame.

        Args:
            filtered: the fusion averages over time.
            solved: a body is fitted to the fused joints.
            of_cameras: the body is fitted to the cameras' joints directly, and filters over time.
        """
        share = NOISE_SHARE * (FILTERED_SHARE if filtered else 1.0)
        if solved:
            share *= SOLVED_SHARE_OF_CAMERAS if of_cameras else SOLVED_SHARE
        misfit, timing_s = (MISFIT_OF_CAMERAS, TIMING_OF_CAMERAS_S) if of_cameras else (MISFIT, TIMING_S)
        self._weights = np.array([(BALL_90 * share) ** 2, misfit**2, timing_s**2])
        self._mean = np.full((3, JOINT_COUNT), np.nan)  # mean squares of noise, misfit and speed
        self._unseen_s = np.full(JOINT_COUNT, UNSEEN_S)
        self._last: NDArray[np.float64] | None = None

    def of(
        self, positions_m: NDArray[np.float64], fused: FusedSkeleton, frames: FrameSet, dt: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the confidence, 0..1, and the radius [mm] of each output joint, shapes (52,).

        The confidence is the probability that the joint is within `CLOSE_M` of the truth, if its error is normal with
        that radius; 0 where unseen.

        Args:
            positions_m: the frame's output joints, shape (52, 3).
            fused: the joints that the body was fitted to.
            frames: the fused frames, with the cameras in the same order.
            dt: time since the last frame [s].
        """
        squared = self._squared_radii(positions_m[OUTPUT_OF_CANONICAL_INDEX], fused, frames, dt)
        return of_output_joints(squared, fused.confidence)

    def _squared_radii(
        self, joints: NDArray[np.float64], fused: FusedSkeleton, frames: FrameSet, dt: float
    ) -> NDArray[np.float64]:
        """Squared radii of the canonical joints [m2], shape (21,)."""
        noise, disagreement, seen = _cameras(
            fused.positions, fused.used, frames.positions, frames.confidence, frames.camera_positions, MIRROR
        )
        self._unseen_s += dt
        self._unseen_s[seen] = 0.0
        moved = joints - (joints if self._last is None else self._last)
        self._last = joints
        now = np.empty((3, JOINT_COUNT))
        now[0] = np.where(seen, noise, np.nan)
        now[1] = np.square(fused.positions - joints).sum(axis=1)
        now[2] = np.square(moved).sum(axis=1) / max(dt, 1e-6) ** 2
        mean = self._mean
        _averaged(mean, now, -np.expm1(-dt / _MEMORY_S))
        unseen = GROWTH_M_S * np.minimum(self._unseen_s, UNSEEN_S)
        return np.fmax(self._weights @ mean, 0.0) + disagreement + unseen * unseen + _OFFSET2


def _probability_within(deviations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Probability of a 3D normal distribution within this many standard deviations of its mean (Maxwell's
    distribution)."""
    x = deviations * _SQRT_HALF
    return erf(x) - _TWO_OVER_SQRT_PI * x * np.exp(-x * x)


@compiled
def _cameras(
    joints: NDArray[np.float64],
    used: NDArray[np.bool_],
    positions: NDArray[np.float64],
    confidence: NDArray[np.float64],
    camera_positions: NDArray[np.float64],
    mirror: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return the cameras' noise and disagreement for fused joints, shape (21,) each.

    Args:
        joints: fused joints [m], shape (21, 3); NaN = unseen.
        used: shape (camera_count, 21).
        positions: shape (camera_count, 21, 3) [m].
        confidence: shape (camera_count, 21).
        camera_positions: shape (camera_count, 3) [m].
        mirror: the joint on the other side, shape (21,).

    Returns:
        Variance of the pooled cameras per axis [m2], undefined where none was used; the squared radius of their
        disagreement beyond it [m2]; and whether any was used.
    """
    count = len(joints)
    noise, disagreement, seen = np.empty(count), np.zeros(count), np.zeros(count, dtype=np.bool_)
    for k in range(count):
        information, beyond = 0.0, 0.0
        for c in range(len(positions)):
            distance2, apart, other = 0.0, 0.0, 0.0
            for a in range(3):
                distance2 += (joints[k, a] - camera_positions[c, a]) ** 2
                apart += (positions[c, k, a] - joints[k, a]) ** 2
                other += (positions[c, mirror[k], a] - joints[k, a]) ** 2
            if apart != apart or not used[c, k]:  # NaN, which differs from itself, where unknown
                continue
            if apart > ELSEWHERE_M**2 and other < apart:
                apart = other
            distance2 = max(distance2, LEAST_DISTANCE_M**2)
            doubt = max(5.25 - 5.0 * confidence[c, k], 1.0)  # as in `joint_noise`
            told = 1.0 / (doubt * doubt * distance2 * (_AXIAL2[k] * distance2 + _LATERAL2[k]))
            information += told
            beyond += told * apart - 6.0  # 6: two cameras' noise, on three axes
        seen[k] = information > 0.0
        noise[k] = 1.0 / max(information, 1e-9)
        disagreement[k] = DISAGREEMENT**2 * noise[k] * max(beyond, 0.0)
    return noise, disagreement, seen


@compiled
def _averaged(mean: NDArray[np.float64], now: NDArray[np.float64], shares: NDArray[np.float64]) -> None:
    """Update mean squares, shape (3, 21), in place; NaN = unknown now, or not yet known."""
    for row in range(len(mean)):
        for k in range(mean.shape[1]):
            if mean[row, k] != mean[row, k]:
                mean[row, k] = now[row, k]
            elif now[row, k] == now[row, k]:
                mean[row, k] += shares[row] * (now[row, k] - mean[row, k])
