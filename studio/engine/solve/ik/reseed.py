"""Restart of a stuck limb: an arm or a leg that stays off its joints is solved again from several starts.

The solve moves a limb by small steps, so it can be caught at the wrong end of a range, where no small step helps.
`LimbReseed` detects this, tries other starts for that limb alone, and takes the best if it is clearly better. The
pose is blended to it over `FADE_S`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import Humanoid
from studio.engine.model.joints import INDEX
from studio.engine.solve.ik.limb_chain import LimbChain

Array = NDArray[np.float64]

STUCK_M = 0.07
STUCK_S = 4 / 30
"""A limb is stuck if the mean distance of its joints exceeds the first for the second."""

FIRST_WAIT_S, LONGEST_WAIT_S = 0.5, 8.0
"""After a trial without a better start, the next one waits, each time about twice as long."""

BETTER = 0.6
"""A start is taken if its remaining distance is at most this share of the present one."""

FADE_S = 0.2
"""Blend time to the new configuration of a limb."""

STARTS = 10
"""Number of starts spread over the limb's ranges, besides its present pose, the one shown by the joints, and rest."""

UNSURE_M = 0.06
"""A joint with a larger standard deviation does not count as evidence of a stuck limb."""

_LIMBS: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = tuple(
    (tuple(f"{side}_{joint}" for joint in joints), tuple(side.capitalize() + body for body in bodies))
    for joints, bodies in (
        (("elbow", "wrist", "hand"), ("Shoulder", "Arm", "ForeArm", "Hand")),
        (("knee", "ankle", "toe"), ("UpLeg", "Leg", "Foot", "ToeBase")),
    )
    for side in ("left", "right")
)
_WATCHED = np.array([[INDEX[name] for name in joints] for joints, _ in _LIMBS])


def _spread_starts(low: Array, high: Array) -> Array:
    """Poses spread evenly over hinge ranges, shape (STARTS, hinge_count): a Kronecker sequence."""
    root = 2.0
    for _ in range(40):  # the root of x^(d + 1) = x + 1 spreads d dimensions best (M. Roberts, 2018)
        root = (1.0 + root) ** (1.0 / (len(low) + 1))
    steps = root ** -np.arange(1.0, len(low) + 1)
    share = (0.5 + np.arange(1, STARTS + 1)[:, None] * steps) % 1.0
    return low + (0.1 + 0.8 * share) * (high - low)


@dataclass(frozen=True)
class _Limb:
    joints: NDArray[np.int64]  # canonical
    chain: LimbChain
    held: NDArray[np.bool_]  # of the chain's hinges
    starts: Array  # (STARTS, hinge_count)

    @property
    def hinges(self) -> NDArray[np.int64]:
        """The humanoid's hinges that a new start may move."""
        return self.chain.hinges[~self.held]


class LimbReseed:
    """Detects stuck arms and legs, frame by frame, and restarts them."""

    def __init__(self, humanoid: Humanoid, *, limited: bool, held: NDArray[np.bool_] | None = None) -> None:
        """`held`: hinges that no new start may move, shape (hinge_count,); None = none."""
        self._humanoid = humanoid
        self._held = np.zeros(len(humanoid.range_rad), dtype=bool) if held is None else held
        self._data = mujoco.MjData(humanoid.model)
        ends = humanoid.range_rad if limited else np.pi * np.array([[-1.0, 1.0]] * len(humanoid.range_rad))
        self._low, self._high = ends.T
        self._limbs = [self._limb(joints, bodies) for joints, bodies in _LIMBS]
        self._stuck_s = np.zeros(len(_LIMBS))
        self._wait_s = np.full(len(_LIMBS), STUCK_S)
        self._fading = np.zeros(len(humanoid.range_rad))
        self._left_s = np.zeros(len(humanoid.range_rad))

    def _limb(self, joints: tuple[str, ...], bodies: tuple[str, ...]) -> _Limb:
        indices = np.array([INDEX[name] for name in joints])
        chain = LimbChain(self._humanoid, bodies, indices, np.stack([self._low, self._high]))
        held = self._held[chain.hinges]
        starts = np.zeros((STARTS, len(held)))
        starts[:, ~held] = _spread_starts(*chain.ranges[:, ~held])
        return _Limb(indices, chain, held, starts)

    def found(
        self,
        q: Array,
        sites: Array,
        targets: Array,
        weights: Array,
        shown: Callable[[], Array | None],
        dt: float,
    ) -> tuple[Array, NDArray[np.int64]] | None:
        """Return a better configuration, shape (nq,), and the hinges that moved, where a limb was stuck; else None.

        Args:
            q: the solved configuration.
            sites: its canonical joints [m], shape (21, 3).
            targets: of these joints [m], shape (21, 3); NaN where the weight is 0.
            weights: 1 / standard deviation [1/m], shape (21,); 0 = not used.
            shown: returns the configuration read from the joints' directions, or None.
            dt: time since the last frame [s].
        """
        error = (sites - targets)[_WATCHED]
        off = np.where(weights[_WATCHED] > 1.0 / UNSURE_M, (error * error).sum(axis=2), 0.0)
        stuck = off.max(axis=1) > STUCK_M**2
        if not stuck.any():
            self._stuck_s[:], self._wait_s[:] = 0.0, STUCK_S
            return None
        self._stuck_s = np.where(stuck, self._stuck_s + dt, 0.0)
        self._wait_s[~stuck] = STUCK_S
        due = np.flatnonzero(self._stuck_s > self._wait_s)
        if not len(due):
            return None
        pose = shown()
        moved = [self._try(int(limb), q, targets, weights, pose) for limb in due]
        changed = [
            (self._limbs[limb].hinges, hinges)
            for limb, hinges in zip(due, moved, strict=True)
            if hinges is not None
        ]
        if not changed:
            return None
        better = q.copy()
        for at, hinges in changed:
            better[7 + at] = hinges
        hinges = np.concatenate([at for at, _ in changed])
        out = self._faded(q[7:])
        self._fading[hinges] = out[hinges] - better[7 + hinges]
        self._left_s[hinges] = FADE_S
        return better, hinges

    def settled(
        self, q: Array, sites: Array, targets: Array, weights: Array, shown: Callable[[], Array | None]
    ) -> Array | None:
        """Return a first pose with its stuck limbs restarted at once, shape (nq,), or None where none was stuck;
        arguments as of `found`.
        """
        error = (sites - targets)[_WATCHED]
        off = np.where(weights[_WATCHED] > 0.0, (error * error).sum(axis=2), 0.0).max(axis=1)
        stuck = np.flatnonzero(off > STUCK_M**2)
        if not len(stuck):
            return None
        better, changed, pose = q.copy(), False, shown()
        for limb in stuck:
            hinges = self._better(self._limbs[limb], q, targets, weights, pose)
            if hinges is not None:
                better[7 + self._limbs[limb].hinges], changed = hinges, True
        return better if changed else None

    def _try(self, limb: int, q: Array, targets: Array, weights: Array, pose: Array | None) -> Array | None:
        """Call `_better`; without a result, the next trial waits longer."""
        hinges = self._better(self._limbs[limb], q, targets, weights, pose)
        if hinges is not None:
            self._stuck_s[limb], self._wait_s[limb] = 0.0, STUCK_S
            return hinges
        wait_s = (
            self._stuck_s[limb] + FIRST_WAIT_S if self._wait_s[limb] == STUCK_S else 2.0 * self._stuck_s[limb]
        )
        self._wait_s[limb] = min(wait_s, self._stuck_s[limb] + LONGEST_WAIT_S)
        return None

    def _better(
        self, part: _Limb, q: Array, targets: Array, weights: Array, pose: Array | None
    ) -> Array | None:
        """A limb's hinges from the best of all starts, including `pose`, or None where none is clearly better."""
        if not len(part.hinges):
            return None
        now = q[7 + part.chain.hinges]
        starts = [now, part.chain.rest, *part.starts]
        if pose is not None:
            starts.append(pose[7 + part.chain.hinges])
        self._data.qpos[:] = q
        mujoco.mj_kinematics(self._humanoid.model, self._data)
        share = weights[part.joints] / weights[part.joints].max()
        targets = np.where(share[:, None] > 0, targets[part.joints], 0.0)
        trials = part.chain.tried(self._data, now, starts, part.held, targets, share)
        best = int(trials.left.argmin())
        return trials.hinges[best][~part.held] if trials.left[best] < BETTER**2 * trials.now else None

    def led(self, q: Array, dt: float) -> Array:
        """Return the output configuration: `q`, blended to the new place of restarted limbs; `dt` after the last."""
        if not self._left_s.any():
            return q
        out = q.copy()
        out[7:] = self._faded(q[7:])
        self._left_s = np.maximum(self._left_s - dt, 0.0)
        return out

    def _faded(self, hinges: Array) -> Array:
        share = self._left_s / FADE_S
        return np.clip(hinges + share * share * (3.0 - 2.0 * share) * self._fading, self._low, self._high)

    def forget(self) -> None:
        """Reset: the performer was found elsewhere."""
        self._stuck_s[:], self._wait_s[:], self._left_s[:] = 0.0, STUCK_S, 0.0
