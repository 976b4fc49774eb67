"""Input of the mannequin: a skeleton's joints by role, and the sizes that follow from them.

File axes: metres, y up, the rest pose faces +z with its left hand towards +x.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.build import STANDARD, Build
from studio.engine.base.errors import FormatError
from studio.engine.model.joints import OUTPUT_PARENT
from studio.engine.model.soles import rest_lift_m

Array = NDArray[np.float64]

NEEDED: tuple[str, ...] = (
    "Hips", "Head",
    *(f"{side}{name}" for side in ("Left", "Right")
      for name in ("Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot")),
)  # fmt: skip
"""Required roles; a missing other role is replaced by the nearest one above it."""

# Place of a head joint: its height over the shoulders, and the crown's over it, as shares of stature. Skeletons have
# it between the skull's base (first) and the middle of the head (last).
_HEAD_JOINT_OVER_SHOULDERS, _CROWN_OVER_HEAD_JOINT = (0.075, 0.115), (0.100, 0.065)
_USUAL_STATURE_M = 1.75


@dataclass(frozen=True)
class MannequinRig:
    """Joints by role, and sizes.

    Attributes:
        index: role -> index of the joint.
        rest_m: joint positions of the rest pose, shape (joint_count, 3).
        floor: height of the soles [m].
        build: width factors of the body.
    """

    index: dict[str, int]
    rest_m: Array
    floor: float
    build: Build = STANDARD

    @classmethod
    def of(
        cls, roles: Sequence[str], rest_m: Array, floor_m: float | None = None, build: Build = STANDARD
    ) -> "MannequinRig":
        """Return the rig of joints with HumanIK roles ("" = none).

        Args:
            floor_m: height of the soles; None = a usual distance below the lowest joint.
            build: of the body.

        Raises:
            FormatError: a required role is missing, or the skeleton does not stand.
        """
        index = {role: joint for joint, role in reversed(list(enumerate(roles))) if role}
        missing = [role for role in NEEDED if role not in index]
        if missing:
            raise FormatError(
                "export.mesh_lacks",
                "the skeleton has no joint for {names}, so no body fits it; leave out the mesh, or "
                "name the joints as HumanIK does",
                names=[*missing],
            )
        rest = np.asarray(rest_m, dtype=np.float64)
        if floor_m is None:
            floor_m = -rest_lift_m(rest[list(index.values()), 1], None)
        rig = cls(index, rest, floor_m, build)
        if (
            not np.isfinite(rig.rest_m).all()
            or rig.at("Head")[1] - rig.floor < 0.3
            or rig.at("Head")[1] <= rig.hip_centre[1]
        ):
            raise FormatError(
                "export.mesh_not_upright",
                "the skeleton's rest pose does not stand upright with y up and a height of at least "
                "0.3 m, so no body fits it; leave out the mesh",
            )
        return rig

    def has(self, role: str) -> bool:
        return role in self.index

    def joint(self, role: str) -> int:
        """Return the index of the role's joint, or of the nearest one above it that exists."""
        while role not in self.index:
            role = OUTPUT_PARENT[role] or "Hips"
        return self.index[role]

    def at(self, role: str) -> Array:
        """Return the rest position of that joint [m], shape (3,)."""
        return self.rest_m[self.joint(role)]

    def weights(self, shares: Mapping[str, Array | float], count: int) -> Array:
        """Return weights over all joints, shape (count, joint_count), of shares by role."""
        out = np.zeros((count, len(self.rest_m)))
        for role, share in shares.items():
            out[:, self.joint(role)] += share
        return out

    @property
    def hip_centre(self) -> Array:
        return (self.at("LeftUpLeg") + self.at("RightUpLeg")) / 2

    @property
    def shoulder_centre(self) -> Array:
        return (self.at("LeftArm") + self.at("RightArm")) / 2

    @property
    def stature(self) -> float:
        """Height of the crown over the soles [m]."""
        joint = float(self.at("Head")[1]) - self.floor
        over_shoulders = float(self.at("Head")[1] - self.shoulder_centre[1])
        share = np.interp(over_shoulders / (1.09 * joint), _HEAD_JOINT_OVER_SHOULDERS, _CROWN_OVER_HEAD_JOINT)
        return joint / (1.0 - float(share))

    @property
    def girth(self) -> float:
        """Scale of widths, 1 for a stature of 1.75 m; small bodies are stouter than large ones."""
        return (self.stature / _USUAL_STATURE_M) ** 0.85

    @property
    def head_height(self) -> float:
        """Height from chin to crown [m]; a child's head is nearly as large as an adult's."""
        return 0.228 * (self.stature / _USUAL_STATURE_M) ** 0.4
