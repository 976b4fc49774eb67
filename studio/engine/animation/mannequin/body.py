"""The body of any skeleton with roles, in its rest pose."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.foot import foot
from studio.engine.animation.mannequin.hand import hand
from studio.engine.animation.mannequin.head import head
from studio.engine.animation.mannequin.limbs import ARM, LEG, limb
from studio.engine.animation.mannequin.mesh import SkinnedMesh, join
from studio.engine.animation.mannequin.rig import MannequinRig
from studio.engine.animation.mannequin.trunk import trunk

if TYPE_CHECKING:
    from studio.engine.animation.clip.skeleton import LocalMotion


def mannequin(motion: "LocalMotion") -> SkinnedMesh:
    """Return the body of a motion's skeleton in its rest pose, in file axes.

    Raises:
        FormatError: the skeleton lacks hips, head or a limb, or its rest pose does not stand.
    """
    return mannequin_mesh(motion.roles, motion.rest_positions_m, floor_m=0.0)


def mannequin_mesh(
    roles: Sequence[str], rest_positions_m: NDArray[np.float64], *, floor_m: float | None = None
) -> SkinnedMesh:
    """Return the body of joints in their rest pose.

    Args:
        roles: HumanIK name of each joint, "" for a joint without a body part, shape (J,).
        rest_positions_m: y up, facing +z, shape (J, 3).
        floor_m: height of its soles; None = a usual distance below its lowest joint.

    Raises:
        FormatError: as `mannequin`.
    """
    rig = MannequinRig.of(roles, rest_positions_m, floor_m)
    parts = [*trunk(rig), *head(rig)]
    for side in ("Left", "Right"):
        parts += [*limb(rig, ARM, side), *hand(rig, side), *limb(rig, LEG, side), *foot(rig, side)]
    return join(parts)
