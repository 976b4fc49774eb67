"""How far each joint of a solved pose may be from the true one: the radius of the 90 % ball, per frame.

The truth is not known live, so the radius is built from what is, each contribution squared and added:

- the **offset**: a device's joint is not the anatomical centre, by about 1 cm per axis, fixed in the bone. No camera
  sees it, so no joint is ever surer than that.
- the **noise** of the cameras that were used, by distance, confidence and joint (`fusion.noise`), pooled over the
  cameras. It is alike for about 0.15 s, so that filter and solve average less of it away than if it were white.
- the **disagreement** of those cameras with the fused joint beyond their noise: one of them, or the fused joint, is
  wrong. A camera that takes left for right counts by the nearer of the two.
- the **misfit** between the fused joint and the solved one: bone lengths, limits or speed keep the body from
  following. Some of it is the solve's mistake and some the joint's.
- the **timing**: clocks, interpolation and filters leave a moving joint some milliseconds behind or ahead.
- the **time unseen**: what nobody sees may be carried on wrongly, up to the reach of the limb.

The coefficients come from quantile regression (Koenker, Bassett, "Regression quantiles", Econometrica 1978) on two of
four recordings with known truth, the offset held at its known size; `ARCHITECTURE.md` says more.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from studio.engine.frames import FrameSet, FusedSkeleton
from studio.engine.fusion.noise import AXIAL_PER_M, JOINT_FACTOR, LATERAL_PER_M, LEAST_DISTANCE_M
from studio.engine.joints import (
    CANONICAL,
    INDEX,
    JOINT_COUNT,
    MIRROR,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL_INDEX,
)

BALL_90 = 2.5
"""Radius of the ball that holds 90 % of a 3D normal distribution, in its deviation per axis."""

OFFSET_M = 0.01
"""Deviation per axis of a device's joint from the anatomical centre, fixed in the bone [m]."""

NOISE_SHARE = 0.9
FILTERED_SHARE = 0.5
SOLVED_SHARE = 0.55
"""Share of the cameras' noise that stays in the joints as they are, after a fusion that filters over time, and after
fitting a body with its motion prior; the last two multiply."""

DISAGREEMENT = 1.35
"""Radius per distance of the cameras from the fused joint beyond their noise."""

MISFIT = 1.0
MISFIT_OF_CAMERAS = 0.8
"""Radius per distance between the fused joint and the solved one; the second where the fused joint is not filtered
over time, so that its noise is in the distance too."""

TIMING_S = 0.015
"""Radius per speed [s]."""

UNSEEN_S = 0.3
"""An unseen joint's radius grows for this long: the body carries it then."""

ELSEWHERE_M = 0.1
"""A camera further than this from a fused joint may have taken left for right."""

_MEMORY_S = np.array([[0.15], [0.05], [0.1]])
"""Over how long the squares of noise, misfit and speed are averaged."""

CLOSE_M = 0.05
"""Confidence is the probability that a joint is this near to the truth."""

_GROWTH = {"elbow": 1.0, "knee": 0.8, "wrist": 1.5, "hand": 1.8, "ankle": 1.2, "toe": 1.3}
GROWTH_M_S: NDArray[np.float64] = np.array([_GROWTH.get(name.split("_")[-1], 0.5) for name in CANONICAL])
"""How fast an unseen joint's radius grows [m/s]: ends of limbs may go far, the trunk is held by its neighbours."""

_OFFSET2 = (BALL_90 * OFFSET_M) ** 2
_AXIAL2 = JOINT_FACTOR**2 * AXIAL_PER_M**2 / 3.0
_LATERAL2 = JOINT_FACTOR**2 * LATERAL_PER_M**2 * 2.0 / 3.0
_SQRT_HALF = float(np.sqrt(0.5))
_TWO_OVER_SQRT_PI = 2.0 / float(np.sqrt(np.pi))

_PHALANX_M = {"1": 0.01, "2": 0.03, "3": 0.045}
"""What the unmeasured bend of a finger adds, from its base to its last joint [m]."""


def _shares() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Which canonical joints an output joint's variance is made of, shape (52, 21), and what is added [m2], (52,).

    A measured joint has its own; a spine joint or clavicle between two measured ones their mean; a finger the hand's
    with what its unmeasured bend adds.
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
        confidence: of the fused joints, shape (21,); 0 = nobody sees it.
    """
    radius = np.sqrt(_SHARES @ squared_radii + _ADDED)
    within = _probability_within(CLOSE_M * BALL_90 / radius)
    return within * (_SHARES @ confidence > 0.0), 1e3 * radius


class Uncertainty:
    """Radii of the 90 % balls and confidences of a performer's joints, frame by frame."""

    def __init__(self, *, filtered: bool, solved: bool, of_cameras: bool = False) -> None:
        """Start with nothing seen.

        Args:
            filtered: the fusion averages over time.
            solved: a body is fitted to the fused joints.
            of_cameras: it is fitted to the cameras' joints themselves, and filters on its own.
        """
        share = NOISE_SHARE * (FILTERED_SHARE if filtered else 1.0) * (SOLVED_SHARE if solved else 1.0)
        misfit = MISFIT_OF_CAMERAS if of_cameras else MISFIT
        self._weights = np.array([(BALL_90 * share) ** 2, misfit**2, TIMING_S**2])
        self._mean = np.full((3, JOINT_COUNT), np.nan)  # of noise, misfit and speed, each squared
        self._unseen_s = np.full(JOINT_COUNT, UNSEEN_S)
        self._last: NDArray[np.float64] | None = None

    def of(
        self, positions_m: NDArray[np.float64], fused: FusedSkeleton, frames: FrameSet, dt: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the confidence, 0..1, and the radius [mm] of each output joint, shapes (52,).

        The confidence is the probability that the joint is within `CLOSE_M` of the truth, were its error normal with
        that radius; 0 where nobody sees it.

        Args:
            positions_m: the frame's output joints, shape (52, 3).
            fused: what the body was fitted to.
            frames: what was fused, its cameras in the same order.
            dt: time since the last frame [s].
        """
        squared = self._squared_radii(positions_m[OUTPUT_OF_CANONICAL_INDEX], fused, frames, dt)
        return of_output_joints(squared, fused.confidence)

    def _squared_radii(
        self, joints: NDArray[np.float64], fused: FusedSkeleton, frames: FrameSet, dt: float
    ) -> NDArray[np.float64]:
        """Squared radii of the canonical joints [m2], shape (21,)."""
        noise, disagreement, seen = _cameras(fused, frames)
        self._unseen_s += dt
        self._unseen_s[seen] = 0.0
        moved = joints - (joints if self._last is None else self._last)
        self._last = joints
        now = np.empty((3, JOINT_COUNT))
        now[0] = np.where(seen, noise, np.nan)
        now[1] = _squares(fused.positions - joints)
        now[2] = _squares(moved) / max(dt, 1e-6) ** 2
        mean = self._mean
        np.copyto(mean, now, where=mean != mean)  # a NaN is not equal to itself: not known yet
        np.copyto(now, mean, where=now != now)  # not known now: stays as it was
        mean += -np.expm1(-dt / _MEMORY_S) * (now - mean)
        unseen = GROWTH_M_S * np.minimum(self._unseen_s, UNSEEN_S)
        return np.fmax(self._weights @ mean, 0.0) + disagreement + unseen * unseen + _OFFSET2


def _squares(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.vecdot(vectors, vectors)


def _probability_within(deviations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of a 3D normal distribution within this many deviations of its middle (Maxwell's distribution)."""
    x = deviations * _SQRT_HALF
    return erf(x) - _TWO_OVER_SQRT_PI * x * np.exp(-x * x)


def _cameras(
    fused: FusedSkeleton, frames: FrameSet
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Variance of the pooled cameras per axis [m2], the squared radius of their disagreement beyond it [m2], and
    whether any was used; shape (21,) each, the first without meaning where none was."""
    joints, positions = fused.positions, frames.positions
    distance2 = np.maximum(_squares(joints - frames.camera_positions[:, None]), LEAST_DISTANCE_M**2)
    doubt = np.maximum(5.25 - 5.0 * frames.confidence, 1.0)  # as `fusion.noise` has it
    variance = doubt * doubt * distance2 * (_AXIAL2 * distance2 + _LATERAL2)
    apart = _squares(positions - joints)
    if np.fmax.reduce(apart, axis=None, initial=0.0) > ELSEWHERE_M**2:
        apart = np.fmin(apart, _squares(positions[:, MIRROR] - joints))
    terms = np.empty((2, *apart.shape))
    np.divide(1.0, variance, out=terms[0])
    np.subtract(terms[0] * apart, 6.0, out=terms[1])  # 6: two cameras' noise, on three axes
    np.copyto(terms, 0.0, where=~(fused.used & (apart == apart)))  # NaN, not equal to itself, where not known
    information, beyond = np.add.reduce(terms, axis=1)
    seen = information > 0.0
    noise = 1.0 / np.maximum(information, 1e-9)
    return noise, DISAGREEMENT**2 * noise * np.maximum(beyond, 0.0), seen
