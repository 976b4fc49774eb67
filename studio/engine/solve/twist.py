"""Straight limbs: what does not show a limb's twist must not turn it.

Where an elbow or knee is straight, its joints lie on the axis that the limb twists about: the elbow's noise alone
would decide the twist, and a limb bent again would bend to a wrong side first (the thesis's flips, 5.5). The
straighter the limb, the more its twist stays as it is.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.human.model import FREE_DOFS, Humanoid

Array = NDArray[np.float64]

SHOWN_RAD = np.radians(40.0)
"""A limb bent by this shows its twist as well as it ever does."""

LEAST_SHARE = 0.15
"""Share of its usual freedom that a straight limb's twist keeps: the hand and the foot still tell a little."""


class LimbTwists:
    """The twists of upper arms and thighs, and how free they are at a bend of the elbow or the knee."""

    def __init__(self, humanoid: Humanoid) -> None:
        def dof(name: str) -> int:
            return int(humanoid.model.joint(name).dofadr[0])

        limbs = [f"{side}{part}" for side in ("Left", "Right") for part in ("Arm", "UpLeg")]
        middles = [f"{side}{part}" for side in ("Left", "Right") for part in ("ForeArm", "Leg")]
        self.dofs = np.array([dof(f"{name}_twist") for name in limbs])
        self._bends = np.array([dof(f"{name}_bend") for name in middles]) - FREE_DOFS + 7

    def freedom(self, q: Array) -> Array:
        """Return the share of its freedom that each twist of `dofs` has at a configuration, shape (4,)."""
        return np.minimum(np.abs(q[self._bends]) / SHOWN_RAD + LEAST_SHARE, 1.0)
