"""The bodies of any skeleton with roles, in its rest pose."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.blocks import blocks
from studio.engine.animation.mannequin.build import SLIM, STANDARD
from studio.engine.animation.mannequin.foot import foot
from studio.engine.animation.mannequin.hand import hand
from studio.engine.animation.mannequin.head import head
from studio.engine.animation.mannequin.limbs import ARM, LEG, limb
from studio.engine.animation.mannequin.mesh import SkinnedMesh, join
from studio.engine.animation.mannequin.rig import MannequinRig
from studio.engine.animation.mannequin.trunk import trunk
from studio.engine.model.performers.bodies import BODIES, check_body

if TYPE_CHECKING:
    from studio.engine.animation.clip.skeleton import LocalMotion

_BUILDS = {"standard": STANDARD, "slim": SLIM}


def mannequin(motion: "LocalMotion", body: str = BODIES[0]) -> SkinnedMesh:
    """Return one of `BODIES` for a motion's skeleton in its rest pose, in file axes.

    Raises:
        SettingsError: no such body.
        FormatError: the skeleton lacks hips, head or a limb, or its rest pose does not stand.
    """
    return mannequin_mesh(motion.roles, motion.rest_positions_m, floor_m=0.0, body=body)


def mannequin_mesh(
    roles: Sequence[str],
    rest_positions_m: NDArray[np.float64],
    *,
    floor_m: float | None = None,
    body: str = BODIES[0],
) -> SkinnedMesh:
    """Return the body of joints in their rest pose.

    Args:
        roles: HumanIK name of each joint, "" for a joint without a body part, shape (J,).
        rest_positions_m: y up, facing +z, shape (J, 3).
        floor_m: height of its soles; None = a usual distance below its lowest joint.
        body: one of `BODIES`.

    Raises:
        FormatError, SettingsError: as `mannequin`.
    """
    if check_body(body) == "blocks":
        return join(blocks(MannequinRig.of(roles, rest_positions_m, floor_m)))
    rig = MannequinRig.of(roles, rest_positions_m, floor_m, _BUILDS[body])
    parts = [*trunk(rig), *head(rig)]
    for side in ("Left", "Right"):
        parts += [*limb(rig, ARM, side), *hand(rig, side), *limb(rig, LEG, side), *foot(rig, side)]
    return join(parts)
