"""One arm or leg alone: how far its joints are off, and what its hinges become from several starts."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.human.model import FREE_DOFS, Humanoid
from studio.engine.solve.limb_kernels import refined

Array = NDArray[np.float64]

ITERATIONS = 10
REST_M = 0.01
"""Distance [m] that weighs as much as a hinge a spread away from rest."""


@dataclass(frozen=True)
class Trials:
    """What is left of a limb where it is, and of each start: squared distances [m2], with the pull to rest.

    Attributes:
        now: where the limb is.
        left: of each start, shape (start_count,).
        hinges: what each start became [rad], shape (start_count, hinge_count).
    """

    now: float
    left: Array
    hinges: Array


class LimbChain:
    """The bodies of a limb, one carrying the next, and the canonical joints on them.

    Attributes:
        hinges: which hinges of the humanoid turn it, ascending, shape (hinge_count,).
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
        self.ranges = ends[:, self.hinges]
        self.rest = humanoid.rest_q[self.hinges]
        self._stiffness = (REST_M / humanoid.spread_rad[self.hinges]) ** 2
        sites = humanoid.site_ids[joints]
        self._carrier = int(model.body_parentid[ids[0]])
        self._chain = (
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
        """Return what becomes of each start.

        Args:
            data: of the humanoid's configuration, after `mj_kinematics`.
            now: the limb's angles there [rad], shape (hinge_count,).
            starts: other angles [rad], each of shape (hinge_count,).
            held: hinges that stay as they are, shape (hinge_count,).
            targets: where the joints should be [m], shape (joint_count, 3).
            share: how much each counts, shape (joint_count,).
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
