"""One arm or leg alone: the residual of its joints, and fits of its hinges from several starts."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.chain import refined
from studio.engine.model.human.humanoid import FREE_DOFS, Humanoid

Array = NDArray[np.float64]

ITERATIONS = 10
REST_M = 0.01
"""Distance [m] with the same cost as a hinge one spread away from rest."""


@dataclass(frozen=True)
class Trials:
    """Costs of a limb as it is and of each fitted start: squared distances [m2], plus the pull to rest.

    Attributes:
        now: cost of the limb as it is.
        left: cost of each start, shape (start_count,).
        hinges: fitted angles of each start [rad], shape (start_count, hinge_count).
    """

    now: float
    left: Array
    hinges: Array


class LimbChain:
    """The bodies of a limb, each the parent of the next, and the canonical joints on them.

    Attributes:
        hinges: indices of the limb's hinges in the humanoid, ascending, shape (hinge_count,).
        ranges: lowest and highest angle of each [rad], shape (2, hinge_count).
        rest: their angles at rest [rad], shape (hinge_count,).
    """

    def __init__(
        self, humanoid: Humanoid, bodies: tuple[str, ...], joints: NDArray[np.int64], ends: Array
    ) -> None:
        """`bodies`: from the trunk outwards; `joints`: canonical ones; `ends`: of all hinges, shape (2, count)."""
        model = humanoid.model
        ids = [int(model.body(name).id) for name in bodies]
        turned = [joint for joint in range(model.njnt) if model.jnt_bodyid[joint] in ids]
        self.hinges = np.array([int(model.jnt_dofadr[joint]) - FREE_DOFS for joint in turned])
        self.ranges = np.ascontiguousarray(ends[:, self.hinges])
        self.rest = humanoid.rest_q[self.hinges]
        self._stiffness = (REST_M / humanoid.spread_rad[self.hinges]) ** 2
        sites = humanoid.site_ids[joints]
        self._carrier = int(model.body_parentid[ids[0]])
        self._chain = (
            np.arange(len(ids)) - 1,
            model.body_pos[ids],
            np.array([ids.index(model.jnt_bodyid[joint]) for joint in turned]),
            model.jnt_axis[turned],
            np.array([ids.index(model.site_bodyid[site]) for site in sites]),
            model.site_pos[sites],
        )

    def tried(
        self,
        data: mujoco.MjData,
        now: Array,
        starts: list[Array],
        held: NDArray[np.bool_],
        targets: Array,
        share: Array,
    ) -> Trials:
        """Fit each start to the targets.

        Args:
            data: of the humanoid's configuration, after `mj_kinematics`.
            now: the limb's angles there [rad], shape (hinge_count,).
            starts: other angles [rad], each of shape (hinge_count,).
            held: hinges that are not changed, shape (hinge_count,).
            targets: of the joints [m], shape (joint_count, 3).
            share: weight of each joint, shape (joint_count,).
        """
        turn, place = data.xmat[self._carrier].reshape(3, 3), data.xpos[self._carrier]
        carrier = np.column_stack([turn, place])
        fixed = self.rest, self._stiffness, targets, share
        anywhere = np.outer([-np.inf, np.inf], np.ones(len(now)))
        left, _ = refined(carrier, *self._chain, now[None], anywhere, *fixed, 0)
        ranges = np.where(held, now, self.ranges)
        return Trials(
            float(left[0]), *refined(carrier, *self._chain, np.array(starts), ranges, *fixed, ITERATIONS)
        )
