"""Conditioning after the solve (step 9): smoothing, then the displacement limit, then the human limits again.

Filters overshoot and turns are cut short on the way, either of which can leave a joint outside its range; so the
ranges are enforced last, and the displacement limit goes on from what was really put out.
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.conditioning.displacement import (
    DisplacementLimitAfter,
    DisplacementLimitBefore,
    limits_m_s,
)
from studio.engine.conditioning.filters import FILTERS, RotationFilter
from studio.engine.geometry import matrices, quaternions
from studio.engine.human.model import Humanoid
from studio.engine.human.skeleton import Skeleton, local_rotations, world_rotations
from studio.engine.settings import SolveSettings
from studio.engine.solve.angles import configuration_of

_TOLERANCE_RAD = 1e-6


class ConditioningAfter:
    """Holds back and smooths the pose of a humanoid, or the joints themselves where there is none (`ik=none`).

    Args:
        settings: whether and how.
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
        """Whether anything is to be done."""
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
        if self._turns is not None:
            root, local = self._turns.held(root, local, dt)
        world = world_rotations(local)
        if self._ranges is not None:
            world = self._ranges.kept(root, world, local)
        if self._turns is not None:
            self._turns.put_out(root, local_rotations(world))
        return root, world

    def joints(self, joints: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
        """Return canonical joints [m], shape (21, 3), conditioned; for a pose without a humanoid."""
        if self._place_filter is not None:
            joints = self._place_filter.apply(joints, dt)
        return joints if self._joints is None else self._joints.apply(joints, dt)


class _Ranges:
    """Brings a pose back within the humanoid's ranges; one that is within is not touched."""

    def __init__(self, humanoid: Humanoid) -> None:
        self._humanoid = humanoid
        self._data = mujoco.MjData(humanoid.model)
        self._low, self._high = humanoid.range_rad.T

    def kept(
        self, root: NDArray[np.float64], world: NDArray[np.float64], local: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return world rotations, shape (52, 3, 3); fingers keep their turn in the hand."""
        q = configuration_of(self._humanoid, root, world, limited=False)
        inside = np.clip(q[7:], self._low, self._high)
        if np.abs(inside - q[7:]).max() < _TOLERANCE_RAD:
            return world
        self._data.qpos[:7], self._data.qpos[7:] = q[:7], inside
        mujoco.mj_kinematics(self._humanoid.model, self._data)
        bodies = self._humanoid.body_outputs
        local = local.copy()
        world = world.copy()
        world[bodies] = self._data.xmat[self._humanoid.body_ids].reshape(-1, 3, 3)
        local[bodies] = local_rotations(world)[bodies]
        return world_rotations(local)
