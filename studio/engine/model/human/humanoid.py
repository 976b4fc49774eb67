"""The MuJoCo humanoid, built from a performer's skeleton.

Bodies have HumanIK names and stage axes in the T-pose, so that a body's world rotation is the output joint's
rotation. The solve's humanoid has no fingers; `completion` poses them. `fingers=True` builds all 52 output joints,
for physics. A site per canonical joint (named as the joint) is what the solve moves towards the measured joint.
`masses` gives the masses. Coupled joints (`COUPLINGS`) are equality constraints: MuJoCo's dynamics enforces them,
kinematics and mink ignore them.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.masses import body_inertias
from studio.engine.model.human.ranges import dofs_of, range_rad
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import (
    CANONICAL,
    FINGERS,
    OUTPUT_INDEX,
    OUTPUT_JOINTS,
    OUTPUT_OF_CANONICAL,
    OUTPUT_PARENT,
)

BODY_JOINTS: tuple[str, ...] = tuple(
    name for name in OUTPUT_JOINTS if "Hand" not in name or name in ("LeftHand", "RightHand")
)
"""Output joints that are bodies of the solve's humanoid: all but the fingers."""

FREE_DOFS = 6

_COUPLING_SOLREF = [0.004, 1.0]
_COUPLING_SOLIMP = [0.99, 0.999, 0.001, 0.5, 2.0]
"""MuJoCo's constraints are soft in proportion to acceleration; a finger bone of 4 g needs firm ones."""


def _couplings() -> dict[str, tuple[str, float]]:
    """The spine bends evenly; a finger's last joint bends two thirds as far as the one before."""
    spine = {
        f"{name}_{dof.name}": (f"Spine_{dof.name}", 1.0)
        for name in ("Spine1", "Spine2")
        for dof in dofs_of(name)
    }
    fingers = {
        f"{side}Hand{finger}3_bend": (f"{side}Hand{finger}2_bend", 2.0 / 3.0)
        for side in ("Left", "Right")
        for finger in FINGERS[1:]
    }
    return spine | fingers


COUPLINGS: dict[str, tuple[str, float]] = _couplings()
"""Hinge -> the hinge it is coupled to and the ratio of their angles. Source of the fingers' two thirds: Rijpkema &
Girard, "Computer animation of knowledge-based human grasping", SIGGRAPH 1991; of the spine: equal ranges.
"""


@dataclass(frozen=True)
class Humanoid:
    """The compiled humanoid and the indices of its parts.

    Attributes:
        model: MuJoCo model; `qpos` is 7 numbers of the free hips, then one per hinge.
        skeleton: the performer's skeleton.
        site_ids: MuJoCo site of each canonical joint, shape (21,).
        body_ids: MuJoCo body of each output joint that is a body, in the order of `body_outputs`.
        body_outputs: indices of these joints in the output skeleton.
        range_rad: (low, high) of each hinge, shape (hinge_count, 2).
        rest_q: resting stance [rad], shape (hinge_count,), the first guess of a solve.
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


def _add_sites(body: mujoco.MjsBody, output: str, skeleton: Skeleton, *, fingers: bool) -> None:
    """Add the sites of this body's canonical joints; a hand without fingers has the site of its knuckle."""
    for canonical, carrier in OUTPUT_OF_CANONICAL.items():
        if carrier == output:
            body.add_site(name=canonical, pos=[0, 0, 0])
        elif not fingers and carrier.endswith("HandMiddle1") and carrier.removesuffix("Middle1") == output:
            body.add_site(name=canonical, pos=skeleton.offsets_m[OUTPUT_INDEX[carrier]])


def _add_couplings(spec: mujoco.MjSpec) -> None:
    for follower, (leader, share) in COUPLINGS.items():
        data = np.zeros(mujoco.mjNEQDATA)
        data[1] = share  # follower = 0 + share * leader
        spec.add_equality(
            type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1=follower, name2=leader,
            data=data, solref=_COUPLING_SOLREF, solimp=_COUPLING_SOLIMP,
        )  # fmt: skip


def build_humanoid(
    skeleton: Skeleton, *, human_limits: bool = True, flexibility: float = 1.0, fingers: bool = False
) -> Humanoid:
    """Return the humanoid of a skeleton.

    Args:
        skeleton: the performer at rest.
        human_limits: whether hinges have human ranges.
        flexibility: 0..2, scales the ranges.
        fingers: add fingers as bodies, and constrain coupled joints: the model for physics.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    names = OUTPUT_JOINTS if fingers else BODY_JOINTS
    inertias = body_inertias(skeleton, fingers=fingers)
    bodies: dict[str, mujoco.MjsBody] = {}
    ranges, rest, spread = [], [], []
    for name in names:
        parent = OUTPUT_PARENT[name]
        carrier = spec.worldbody if parent is None else bodies[parent]
        body = carrier.add_body(name=name, pos=skeleton.offsets_m[OUTPUT_INDEX[name]])
        body.mass, body.ipos = inertias[name].mass_kg, inertias[name].centre_m
        body.inertia, body.explicitinertial = inertias[name].inertia_kg_m2, True
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
        _add_sites(body, name, skeleton, fingers=fingers)
        bodies[name] = body
    if fingers:
        _add_couplings(spec)
    model = spec.compile()
    return Humanoid(
        model=model,
        skeleton=skeleton,
        site_ids=np.array([model.site(name).id for name in CANONICAL]),
        body_ids=np.array([model.body(name).id for name in names]),
        body_outputs=np.array([OUTPUT_INDEX[name] for name in names]),
        range_rad=np.array(ranges),
        rest_q=np.array(rest),
        spread_rad=np.array(spread),
    )
