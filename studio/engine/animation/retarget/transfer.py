"""Transfer of a performer's motion onto a rig: rotations by the T-pose, the path by leg length, feet and hands by IK.

Each mapped bone gets the world rotation of its role after the rotation from the rig's rest pose to the T-pose
(`rest`), so directions of limbs are the performer's. The hips' path is scaled by the ratio of leg lengths, about the
floor. Then legs and arms are bent to the targets of feet and hands (`limbs`).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.kinematics import local_keys, world_poses
from studio.engine.animation.clip.root_motion import heading_of
from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.retarget.floor import floor_shifts
from studio.engine.animation.retarget.limbs import (
    ARM,
    LEG,
    Places,
    allowed_reach,
    ankle_targets,
    bend,
    hand_targets,
    hips_drop,
    length_of,
)
from studio.engine.animation.retarget.mapping import Mapping
from studio.engine.animation.retarget.rest import t_pose_turns
from studio.engine.animation.retarget.rig import Rig
from studio.engine.animation.retarget.skeleton import Posed, local_of
from studio.engine.base.errors import SettingsError
from studio.engine.base.geometry import quaternions
from studio.engine.base.quaternions import multiply, normalized, rotate
from studio.engine.model.soles import USUAL_TOE_HEIGHT_M

Array = NDArray[np.float64]

_SIDES = ("Left", "Right")
_UP = np.array([0.0, 1.0, 0.0])
_BENDS = {
    "LeftLeg": (1.0, 0.0, 0.0), "RightLeg": (1.0, 0.0, 0.0),
    "LeftForeArm": (0.0, -1.0, 0.0), "RightForeArm": (0.0, 1.0, 0.0),
}  # fmt: skip
"""Role -> the axis of its limb's middle joint, in the T-pose; a positive turn bends the limb."""

_NEEDED = ("Hips", *(side + part for side in _SIDES for part in LEG))


@dataclass(frozen=True)
class RigBody:
    """A rest pose on the floor, and a motion, by role.

    Attributes:
        rest: positions, y up, facing +z, the floor at 0 [m], shape (3,) each.
        leg_m, span_m: mean length of a leg, and half the distance from wrist to wrist with stretched arms; the span
            is 0 without arms.
    """

    rest: Places

    @property
    def leg_m(self) -> float:
        return sum(length_of(self.rest, side, LEG) for side in _SIDES) / 2

    @property
    def span_m(self) -> float:
        if not self.has_arms:
            return 0.0
        wide = float(np.linalg.norm(self.rest["LeftArm"] - self.rest["RightArm"]))
        return (wide + sum(length_of(self.rest, side, ARM) for side in _SIDES)) / 2

    @property
    def has_arms(self) -> bool:
        return all(side + part in self.rest for side in _SIDES for part in ARM)


def retargeted(motion: LocalMotion, mapping: Mapping, root_motion: str = "hips") -> LocalMotion:
    """Return the motion on a rig: all its bones in their order, in its own rest pose.

    Args:
        motion: with HumanIK roles and identity axes, hips first (`local_motion`).
        mapping: of the rig.
        root_motion: one of `ROOT_MOTIONS`; `root` moves the rig's root bone, which must be above the hips.

    Raises:
        SettingsError: the motion lacks hips or legs, or the rig lacks the requested root bone.
        FormatError: the rig's rest pose cannot be retargeted.
    """
    joints = {role: joint for joint, role in enumerate(motion.roles) if role}
    lacking = [role for role in _NEEDED if role not in joints]
    if lacking:
        raise SettingsError(
            "rig.solve_lacks",
            "rig: the solve's skeleton lacks {names}; leave the option out",
            names=[*lacking],
        )
    positions, turns = world_poses(motion.parents, motion.local_positions_m(), motion.rotations_wxyz)
    rest = motion.rest_positions_m
    source = RigBody({role: rest[joint] for role, joint in joints.items()})
    moving = {role: positions[:, joint] for role, joint in joints.items()}
    rig = on_floor(mapping, source)
    mapping = Mapping(rig, mapping.roles)
    own = RigBody({role: rig.positions_m[joint] for role, joint in mapping.joints.items()})
    t_turns = quaternions(t_pose_turns(mapping, source.rest))
    turned = {
        joint: multiply(turns[:, joints[carrier]], t_turns[joint])
        for role, joint in mapping.joints.items()
        if (carrier := _carrier(role, joints)) is not None
    }
    posed = _with_hips(rig, mapping, moving, source, own, turned)
    axes = {
        role: rotate(turns[:, joints[role]], np.array(axis))
        for role, axis in _BENDS.items()
        if role in joints
    }
    posed = _legs(posed, mapping, moving, (source, own), axes, motion.frames_per_second)
    if own.has_arms and source.has_arms:
        posed = _arms(posed, mapping, moving, (source, own), axes)
    return _as_motion(motion, mapping, posed, root_motion)


def _carrier(role: str, joints: dict[str, int]) -> str | None:
    """Return the motion's role that turns a bone of a role; for a spine, the nearest one below."""
    lower = {"Spine1": ("Spine1", "Spine"), "Spine2": ("Spine2", "Spine1", "Spine")}.get(role, (role,))
    return next((name for name in lower if name in joints), None)


def on_floor(mapping: Mapping, source: RigBody) -> Rig:
    """Return the rig with its floor at y = 0: its own floor if it stands there, or under its feet."""
    rig, joints = mapping.rig, mapping.joints
    at = {role: rig.positions_m[joint] for role, joint in joints.items()}
    leg = RigBody(at).leg_m
    lowest = min(at[role][1] for role in at if role.endswith(("Foot", "ToeBase")))
    if -0.02 * leg <= lowest <= 0.2 * leg:
        return rig
    sole = USUAL_TOE_HEIGHT_M * leg / source.leg_m
    return replace(rig, positions_m=rig.positions_m + np.array([0.0, sole - lowest, 0.0]))


def _with_hips(
    rig: Rig, mapping: Mapping, moving: Places, source: RigBody, own: RigBody, turned: dict[int, Array]
) -> Posed:
    """Return the rig with its bones turned, and the middle of its hip joints on the scaled path."""
    ratio, hips = own.leg_m / source.leg_m, mapping.joints["Hips"]
    middle = ratio * (moving["LeftUpLeg"] + moving["RightUpLeg"]) / 2
    ankles, source_ankles = (
        (body.rest["LeftFoot"][1] + body.rest["RightFoot"][1]) / 2 for body in (own, source)
    )
    middle[:, 1] += ankles - ratio * source_ankles
    arm = (own.rest["LeftUpLeg"] + own.rest["RightUpLeg"]) / 2 - own.rest["Hips"]
    return Posed(rig, turned, hips, middle - rotate(turned[hips], arm))


def _legs(
    posed: Posed, mapping: Mapping, moving: Places, bodies: tuple[RigBody, RigBody], axes: Places, hz: float
) -> Posed:
    """Return the rig with its feet at their targets, and its hips lower where a leg is too short."""
    (source, own), joints = bodies, mapping.joints
    positions, turns = posed.place()
    ratio = own.leg_m / source.leg_m
    shifts = floor_shifts(moving, source.rest, ratio, hz)
    targets, far = [], []
    for side in _SIDES:
        foot_turn = turns[:, joints[f"{side}Foot"]]
        target = ankle_targets(moving, source.rest, own.rest, foot_turn, side, ratio)
        targets.append(target + shifts[side][:, None] * _UP)
        far.append(allowed_reach(moving, source.rest, own.rest, side, LEG))
    roots = [positions[:, joints[f"{side}UpLeg"]] for side in _SIDES]
    drop = hips_drop(roots, targets, far, [own.rest[f"{side}Foot"][1] for side in _SIDES], hz)
    posed = replace(posed, hips_m=posed.hips_m - drop[:, None] * _UP)
    for side, target, limit in zip(_SIDES, targets, far, strict=True):
        posed = bend(posed, joints, side, LEG, target, axes[f"{side}Leg"], limit)
    return posed


def _arms(
    posed: Posed, mapping: Mapping, moving: Places, bodies: tuple[RigBody, RigBody], axes: Places
) -> Posed:
    """Return the rig with its hands at their targets."""
    source, own = bodies
    positions, _ = posed.place()
    places = {role: positions[:, joint] for role, joint in mapping.joints.items()}
    targets = hand_targets(moving, places, own.span_m / source.span_m, own.leg_m / source.leg_m)
    for side in _SIDES:
        far = allowed_reach(moving, source.rest, own.rest, side, ARM)
        posed = bend(posed, mapping.joints, side, ARM, targets[f"{side}Hand"], axes[f"{side}ForeArm"], far)
    return posed


def _as_motion(motion: LocalMotion, mapping: Mapping, posed: Posed, root_motion: str) -> LocalMotion:
    """Return the posed rig as a rest skeleton with keys, its path on the chosen carrier."""
    rig, hips = mapping.rig, posed.hips
    positions, turns = posed.place()
    moved = {hips}
    path = posed.hips_m * [1.0, 0.0, 1.0]
    body = [joint for joint in range(len(rig.parents)) if rig.below(joint, hips)]
    if root_motion == "in-place":
        positions[:, body] -= path[:, None]
    elif root_motion == "root":
        if rig.parents[hips] < 0:
            raise SettingsError(
                "rig.no_root_bone",
                "root-motion=root: the hips are the root of {path}; leave the option out, or give a "
                "rig with a root bone above them",
                path=rig.path.name,
            )
        heading = heading_of(turns[:, hips])
        rest = [joint for joint in range(len(rig.parents)) if joint not in set(body)]
        for joint in rest:
            positions[:, joint] = path + rotate(heading, rig.positions_m[joint])
            turns[:, joint] = heading
        moved.add(0)
    offsets, _ = local_of(rig.parents, rig.positions_m, rig.rotations_wxyz)
    places, rotations = local_keys(rig.parents, positions, normalized(multiply(turns, rig.rotations_wxyz)))
    return LocalMotion(
        joint_names=rig.joint_names,
        roles=mapping.roles,
        parents=rig.parents,
        frames_per_second=motion.frames_per_second,
        offsets_m=offsets,
        rest_rotations_wxyz=rig.rotations_wxyz,
        positions_m={joint: places[:, joint] for joint in sorted(moved)},
        rotations_wxyz=rotations,
        name=motion.name,
        start_s=motion.start_s,
    )
