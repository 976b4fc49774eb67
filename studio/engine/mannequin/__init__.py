"""The mannequin: a clean body for any performer, skinned to the output skeleton, made by code alone.

`rig` finds the joints by role and the sizes that follow from them; `trunk`, `limbs`, `head`, `hand` and `foot` make
closed parts from lofts (`loft`); `mesh` joins them. Its shapes are drawn for looks: nothing in it comes from the
tracker's model or from the depth simulator's performers, nor they from it.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.engine.mannequin.foot import foot
from studio.engine.mannequin.hand import hand
from studio.engine.mannequin.head import head
from studio.engine.mannequin.limbs import ARM, LEG, limb
from studio.engine.mannequin.mesh import BODY, SEAM, SkinnedMesh, join
from studio.engine.mannequin.rig import Rig
from studio.engine.mannequin.trunk import trunk

if TYPE_CHECKING:
    from studio.engine.export.skeleton import LocalMotion

__all__ = ["BODY", "SEAM", "SkinnedMesh", "mannequin", "mannequin_mesh"]


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
        roles: HumanIK name of each joint, "" for one that carries nothing, shape (J,).
        rest_positions_m: y up, facing +z, shape (J, 3).
        floor_m: height of its soles; None = a usual way below its lowest joint.

    Raises:
        FormatError: as `mannequin`.
    """
    rig = Rig.of(roles, rest_positions_m, floor_m)
    parts = [*trunk(rig), *head(rig)]
    for side in ("Left", "Right"):
        parts += [*limb(rig, ARM, side), *hand(rig, side), *limb(rig, LEG, side), foot(rig, side)]
    return join(parts)
