"""Straight limbs: damping of a twist that the joints do not show.

The joints of a straight elbow or knee lie on the axis of the limb's twist. The elbow's noise alone would decide the
twist, and the limb would bend to a wrong side first (the thesis's flips, 5.5). The straighter the limb, the more its
twist is damped.
"""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import FREE_DOFS, Humanoid

Array = NDArray[np.float64]

SHOWN_RAD = np.radians(40.0)
"""Bend of a limb from which its twist is fully observable."""

LEAST_SHARE = 0.15
"""Freedom of a straight limb's twist as a share of the usual: hand and foot still show a little of it."""


class LimbTwists:
    """The twists of upper arms and thighs, and their freedom at a bend of the elbow or the knee."""

    def __init__(self, humanoid: Humanoid) -> None:
        def dof(name: str) -> int:
            return int(humanoid.model.joint(name).dofadr[0])

        limbs = [f"{side}{part}" for side in ("Left", "Right") for part in ("Arm", "UpLeg")]
        middles = [f"{side}{part}" for side in ("Left", "Right") for part in ("ForeArm", "Leg")]
        self.dofs = np.array([dof(f"{name}_twist") for name in limbs])
        self._bends = np.array([dof(f"{name}_bend") for name in middles]) - FREE_DOFS + 7

    def freedom(self, q: Array) -> Array:
        """Return the freedom of each twist of `dofs` at a configuration, as a share, shape (4,)."""
        return np.minimum(np.abs(q[self._bends]) / SHOWN_RAD + LEAST_SHARE, 1.0)
