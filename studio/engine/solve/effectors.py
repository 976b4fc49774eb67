"""What `effectors.<joint>.pull` and `.resist` do to the solve's degrees of freedom; `reach` weighs a joint's rows."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.human.model import BODY_JOINTS, FREE_DOFS, Humanoid
from studio.engine.human.ranges import dofs_of
from studio.engine.joints import CANONICAL, OUTPUT_OF_CANONICAL
from studio.engine.settings import Effector

HELD = 1e-4
"""Freedom of a joint that resists wholly."""


def _dof_outputs() -> list[str]:
    """The output joint of each degree of freedom."""
    return ["Hips"] * FREE_DOFS + [name for name in BODY_JOINTS[1:] for _ in dofs_of(name)]


def pull_scale(humanoid: Humanoid, effectors: dict[str, Effector]) -> NDArray[np.float64] | None:
    """Return each joint's share of influence on each degree of freedom, shape (21, nv): `pull` on what lies beyond
    its own limb (hips, spine, clavicles), 1 within it; None where every pull is whole."""
    pulls = np.array([effectors[name].pull for name in CANONICAL])
    if (pulls == 1.0).all():
        return None
    trunk = [
        name == "Hips" or name.startswith("Spine") or name.endswith("Shoulder") for name in _dof_outputs()
    ]
    limb = ["_" in name and not name.endswith(("shoulder", "hip")) for name in CANONICAL]
    assert len(trunk) == humanoid.model.nv
    return np.where(np.outer(limb, trunk), pulls[:, None], 1.0)


def resist_scale(humanoid: Humanoid, effectors: dict[str, Effector]) -> NDArray[np.float64]:
    """Return how freely each degree of freedom leaves the pose that it had, shape (nv,): 1 where its joint does not
    resist, `HELD` where it resists wholly. The hips go where they go: what resists there is their turn."""
    by_output = {OUTPUT_OF_CANONICAL[name]: effector.resist for name, effector in effectors.items()}
    resists = np.array([by_output.get(name, 0.0) for name in _dof_outputs()])
    resists[:3] = 0.0
    assert len(resists) == humanoid.model.nv
    return np.maximum((1.0 - resists) ** 2, HELD)
