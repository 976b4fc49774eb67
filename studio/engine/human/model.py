"""The MuJoCo humanoid: built from a performer's skeleton, driven by the solve.

Bodies carry HumanIK names and stand with stage axes in the T-pose, so that a body's world rotation is the
output joint's rotation. Fingers are not bodies: `completion` poses them. A site per canonical joint (named
as the joint) is what the solve moves towards the measured joints.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.human.ranges import dofs_of, range_rad
from studio.engine.human.skeleton import Skeleton
from studio.engine.joints import (
    CANONICAL,
    OUTPUT_INDEX,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL,
    OUTPUT_PARENT,
)

BODY_JOINTS: tuple[str, ...] = tuple(
    name for name in OUTPUT_JOINTS if "Hand" not in name or name in ("LeftHand", "RightHand")
)
"""Output joints that are bodies of the humanoid: all but the fingers."""

FREE_DOFS = 6


@dataclass(frozen=True)
class Humanoid:
    """The compiled humanoid and where its parts are.

    Attributes:
        model: MuJoCo model; `qpos` is 7 numbers of the free hips, then one per hinge.
        skeleton: the performer's skeleton it was built from.
        site_ids: MuJoCo site of each canonical joint, shape (21,).
        body_ids: MuJoCo body of each output joint that is a body, in the order of `body_outputs`.
        body_outputs: index of those in the output skeleton.
        range_rad: (low, high) of each hinge, shape (hinge_count, 2).
        rest_q: resting stance [rad], shape (hinge_count,).
        spread_rad: usual distance from the resting stance, shape (hinge_count,).
    """

    model: mujoco.MjModel
    skeleton: Skeleton
    site_ids: NDArray[np.int64]
    body_ids: NDArray[np.int64]
    body_outputs: NDArray[np.int64]
    range_rad: NDArray[np.float64]
    rest_q: NDArray[np.float64]
    spread_rad: NDArray[np.float64]

    @property
    def rest_qpos(self) -> NDArray[np.float64]:
        """The resting stance over the stage's origin, facing -y."""
        return np.concatenate([self.skeleton.offsets_m[0], [1.0, 0.0, 0.0, 0.0], self.rest_q])


def _add_sites(body: mujoco.MjsBody, output: str, skeleton: Skeleton) -> None:
    """Add the sites of the canonical joints that this body carries, the knuckle of the hand included."""
    for canonical, carrier in OUTPUT_OF_CANONICAL.items():
        if carrier == output:
            body.add_site(name=canonical, pos=[0, 0, 0])
        elif carrier.endswith("HandMiddle1") and carrier.removesuffix("Middle1") == output:
            body.add_site(name=canonical, pos=skeleton.offsets_m[OUTPUT_INDEX[carrier]])


def build_humanoid(skeleton: Skeleton, *, human_limits: bool = True, flexibility: float = 1.0) -> Humanoid:
    """Return the humanoid of a skeleton.

    Args:
        skeleton: the performer at rest.
        human_limits: whether hinges are limited to what a human can reach.
        flexibility: 0..2, scales the limits.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    bodies: dict[str, mujoco.MjsBody] = {}
    ranges, rest, spread = [], [], []
    for name in BODY_JOINTS:
        parent = OUTPUT_PARENT[name]
        carrier = spec.worldbody if parent is None else bodies[parent]
        body = carrier.add_body(name=name, pos=skeleton.offsets_m[OUTPUT_INDEX[name]])
        body.mass, body.inertia, body.explicitinertial = 1.0, [0.01, 0.01, 0.01], True
        if parent is None:
            body.add_freejoint(name=name)
        for dof in dofs_of(name):
            limits = range_rad(dof, flexibility)
            body.add_joint(
                name=f"{name}_{dof.name}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=dof.axis,
                limited=human_limits, range=limits,
            )  # fmt: skip
            ranges.append(limits)
            rest.append(np.clip(np.radians(dof.rest_deg), *limits))
            spread.append(np.radians(dof.spread_deg))
        _add_sites(body, name, skeleton)
        bodies[name] = body
    model = spec.compile()
    return Humanoid(
        model=model,
        skeleton=skeleton,
        site_ids=np.array([model.site(name).id for name in CANONICAL]),
        body_ids=np.array([model.body(name).id for name in BODY_JOINTS]),
        body_outputs=np.array([OUTPUT_INDEX[name] for name in BODY_JOINTS]),
        range_rad=np.array(ranges),
        rest_q=np.array(rest),
        spread_rad=np.array(spread),
    )
