"""The effect of `effectors.<joint>.pull` and `.resist` on the degrees of freedom; `reach` weighs a joint's rows."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import BODY_JOINTS, FREE_DOFS, Humanoid
from studio.engine.model.human.ranges import dofs_of
from studio.engine.model.joints import CANONICAL, OUTPUT_OF_CANONICAL
from studio.engine.model.settings.switches import Effector

HELD = 1e-4
"""Freedom of a joint at full resistance."""


def _dof_outputs() -> list[str]:
    """The output joint of each degree of freedom."""
    return ["Hips"] * FREE_DOFS + [name for name in BODY_JOINTS[1:] for _ in dofs_of(name)]


def pull_scale(humanoid: Humanoid, effectors: dict[str, Effector]) -> NDArray[np.float64] | None:
    """Return each joint's share of influence on each degree of freedom, shape (21, nv): 1 within its own limb, `pull`
    beyond it (hips, spine, clavicles). Return None where every pull is 1.
    """
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
    """Return the freedom of each degree of freedom to leave its last pose, shape (nv,): 1 without resistance, `HELD`
    at full resistance. Resistance of the hips acts on their rotation only.
    """
    by_output = {OUTPUT_OF_CANONICAL[name]: effector.resist for name, effector in effectors.items()}
    resists = np.array([by_output.get(name, 0.0) for name in _dof_outputs()])
    resists[:3] = 0.0
    assert len(resists) == humanoid.model.nv
    return np.maximum((1.0 - resists) ** 2, HELD)
