"""Conditioning after the solve (step 9): smoothing, then the human limits again, then the displacement limit.

A filter's overshoot can leave a joint outside its range; so can a turn that the limit cuts short. Both are clamped,
and the displacement limit continues from the pose after clamping.
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import matrices, quaternions
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.humanoid import Humanoid
from studio.engine.model.human.skeleton import Skeleton, local_rotations, world_rotations
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.conditioning.displacement import (
    DisplacementLimitAfter,
    DisplacementLimitBefore,
    limits_m_s,
)
from studio.engine.solve.conditioning.filters import FILTERS, RotationFilter

_TOLERANCE_RAD = 1e-6
_HOLDS = 4  # attempts to shorten a step until every joint is slow enough


class ConditioningAfter:
    """Limits and smooths the pose of a humanoid, or the joints themselves without a humanoid (`ik=none`).

    Args:
        settings: of the solve.
        skeleton: the performer.
        humanoid: of the solve, or None; its ranges are kept where `human_limits` is on.
    """

    def __init__(self, settings: SolveSettings, skeleton: Skeleton, humanoid: Humanoid | None) -> None:
        limits = limits_m_s(settings.displacement_limits_m_s)
        limited = settings.displacement_limit == "after"
        self._turns = DisplacementLimitAfter(skeleton, limits) if limited else None
        self._joints = DisplacementLimitBefore(limits) if limited and humanoid is None else None
        smoothing = settings.smoothing_filter
        make = FILTERS[smoothing[0]] if smoothing is not None and smoothing[1] == "after" else None
        self._place_filter = None if make is None else make()
        self._turn_filter = None if make is None else RotationFilter(make())
        self._ranges = None
        if humanoid is not None and settings.human_limits == "on":
            self._ranges = _Ranges(humanoid)

    @property
    def active(self) -> bool:
        """Whether any setting changes the pose."""
        return self._turns is not None or self._turn_filter is not None

    def apply(
        self, root: NDArray[np.float64], rotations: NDArray[np.float64], dt: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the hips' position [m], shape (3,), and the world rotations, shape (52, 3, 3), conditioned."""
        if not self.active:
            return root, rotations
        local = local_rotations(rotations)
        if self._turn_filter is not None:
            if self._joints is None and self._place_filter is not None:
                root = self._place_filter.apply(root[None], dt)[0]
            local = matrices(self._turn_filter.apply(quaternions(local), dt))
            if self._ranges is not None:
                local = self._ranges.kept(root, local)
        if self._turns is not None:
            aim = local
            root, local = self._turns.held(root, aim, dt)
            if self._ranges is not None and local is not aim:
                local = self._ranges.on_the_way(root, local, aim, self._turns, dt)
            self._turns.put_out(root, local)
        return root, world_rotations(local)

    def joints(self, joints: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        """Return canonical joints [m], shape (21, 3), conditioned; for a pose without a humanoid."""
        if self._place_filter is not None:
            joints = self._place_filter.apply(joints, dt)
        return joints if self._joints is None else self._joints.apply(joints, dt)


class _Ranges:
    """Clamps a pose to the humanoid's ranges; a pose within them is not changed."""

    def __init__(self, humanoid: Humanoid) -> None:
        self._humanoid = humanoid
        self._data = mujoco.MjData(humanoid.model)
        self._low, self._high = humanoid.range_rad.T
        place = {int(body): k for k, body in enumerate(humanoid.body_ids)}
        self._body_of_hinge = np.array([place[int(body)] for body in humanoid.model.jnt_bodyid[1:]])

    def kept(self, root: NDArray[np.float64], local: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rotations in the parent, shape (52, 3, 3), clamped to the ranges; fingers keep theirs."""
        q = configuration_of(self._humanoid, root, world_rotations(local), limited=False)
        inside = np.clip(q[7:], self._low, self._high)
        if np.abs(inside - q[7:]).max() < _TOLERANCE_RAD:
            return local
        q[7:] = inside
        return self._local(q, local)

    def on_the_way(
        self,
        root: NDArray[np.float64],
        held: NDArray[np.float64],
        aim: NDArray[np.float64],
        turns: DisplacementLimitAfter,
        dt: float,
    ) -> NDArray[np.float64]:
        """Return rotations between the last ones and `aim`, with every hinge within its range.

        The direct turn towards the aim, as in `held`, can lead outside the ranges; moving hinge by hinge cannot.
        """
        last = turns.last_local
        start = configuration_of(self._humanoid, root, world_rotations(last))[7:]
        q = configuration_of(self._humanoid, root, world_rotations(aim))
        way, share = q[7:] - start, np.ones(len(start))
        q[3:7] = quaternions(held[:1])[0]
        local = held
        for _ in range(_HOLDS):
            q[7:] = start + share * way
            local = self._local(q, held)
            allowed = turns.shares(local, dt)[self._humanoid.body_outputs]
            if (allowed > 0.999).all():
                break
            share *= allowed[self._body_of_hinge]
        return local

    def _local(self, q: NDArray[np.float64], fingers: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rotations in the parent of a configuration, with the fingers' from `fingers`."""
        self._data.qpos[:] = q
        mujoco.mj_kinematics(self._humanoid.model, self._data)
        bodies = self._humanoid.body_outputs
        world = np.tile(np.eye(3), (len(fingers), 1, 1))
        world[bodies] = self._data.xmat[self._humanoid.body_ids].reshape(-1, 3, 3)
        local = fingers.copy()
        local[bodies] = local_rotations(world)[bodies]
        return local
