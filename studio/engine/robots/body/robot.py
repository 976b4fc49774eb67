"""A humanoid robot measured as a body: key points, lengths, soles, limits, and the model that moves them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.robots.body.collisions import with_floor
from studio.engine.robots.body.parts import LIMBS, PARTS, SIDES, Tree, found_parts
from studio.engine.robots.body.reading import ReadModel, compiled, read_model
from studio.engine.robots.body.strength import torque_limits
from studio.engine.robots.body.surface import surface_points
from studio.engine.robots.free_joint import FREE, FREE_DOFS

Array = NDArray[np.float64]

USUAL_VELOCITY_RAD_S = 3.0 * np.pi
"""Velocity limit of a hinge where the model states none: that of General Motion Retargeting."""

SOLE_M = 0.01
"""Height above a foot's lowest point up to which points belong to its sole."""

LEVER_M = 0.2
"""Length of the levers that show the rotation of pelvis, torso and head."""

THUMB_M = 0.08
HAND_SHARE = 0.85
"""Length of the lever that shows a hand's rotation; position of a hand without a named site, as a share of the
distance from elbow to the end of the arm."""

SIDEWAYS = 0.6
"""Sideways share of a bone's length above which it is an arm of a T-pose."""

BENT_RAD = 0.05
"""Least bend of knees and elbows in a solve, where their limits would let them bend backwards."""

CORNERS = ("heel_in", "heel_out", "toe_in", "toe_out")
POINTS: tuple[str, ...] = (
    "pelvis_up", "torso_front", "head_front",
    *(f"{side}_{part}" for side in SIDES for part in ("hip", "knee", "ankle", "shoulder", "elbow", "hand", "thumb")),
    *(f"{side}_{corner}" for side in SIDES for corner in CORNERS),
)  # fmt: skip
"""Points of a robot that follow a performer. A knee, for example, is the centre of the knee's joint."""

INDEX = {name: k for k, name in enumerate(POINTS)}


@dataclass(frozen=True)
class Robot:
    """A robot that can be moved by a performer.

    Attributes:
        name: for the user.
        parts: body of each part (`parts.PARTS`).
        model: the model with a free base first, a site for each of `POINTS`, and a floor.
        joint_names: hinges in the model's order, shape (hinge_count,).
        range_rad: limits of each hinge, shape (hinge_count, 2).
        velocity_rad_s: velocity limit of each hinge, shape (hinge_count,).
        torque_nm: lowest and highest torque of each hinge, infinite where the model gives none, shape
            (hinge_count, 2).
        unlimited: hinges without limits in the file; `range_rad` has +-pi for them.
        active: whether a hinge moves any of `POINTS`; the others (fingers) keep their angle, shape (hinge_count,).
        rest: hinge angles of a relaxed stance, within limits, shape (hinge_count,).
        bent_rad: limits for a solve: as `range_rad`, but knees and elbows do not bend backwards.
        site_ids: site of each of `POINTS`.
        base_m: position of the base in the zero pose, axes as in `at_rest_m`, shape (3,).
        at_rest_m: positions of `POINTS` in the zero pose, x ahead, y left, z up, soles at z = 0, centre of the hips
            at x = y = 0, shape (point_count, 3).
        ankle_m: ankles in the zero pose, left and right, shape (2, 3).
        lengths_m: thigh, shank, upper_arm, forearm.
        bend_axes: bending axis of each knee and elbow in the zero pose, by part.
        collides: whether the file has geometry that collides.
    """

    name: str
    parts: Mapping[str, str]
    model: mujoco.MjModel
    joint_names: tuple[str, ...]
    range_rad: Array
    velocity_rad_s: Array
    torque_nm: Array
    unlimited: tuple[str, ...]
    active: NDArray[np.bool_]
    rest: Array
    bent_rad: Array
    site_ids: NDArray[np.int64]
    base_m: Array
    at_rest_m: Array
    ankle_m: Array
    lengths_m: Mapping[str, float]
    bend_axes: Mapping[str, Array]
    collides: bool

    @property
    def leg_m(self) -> float:
        """Length of a straight leg from hip to sole [m]."""
        return self.lengths_m["thigh"] + self.lengths_m["shank"] + float(self.ankle_m[0, 2])

    @property
    def height_m(self) -> float:
        """Height of the zero pose [m]: of its geometry or of `POINTS`, whichever is larger."""
        data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, data)
        points = surface_points(self.model, data, range(1, self.model.nbody))
        own = float(np.ptp(self.at_rest_m[:, 2]))
        return max(own, float(np.ptp(points[:, 2]))) if len(points) else own

    @property
    def standing(self) -> Array:
        """Configuration of the relaxed stance, soles near z = 0, shape (nq,)."""
        q = np.zeros(self.model.nq)
        q[:3], q[3], q[FREE:] = self.base_m, 1.0, self.rest
        return q


def build_robot(
    path: Path,
    name: str,
    *,
    parts: Mapping[str, str] | None = None,
    velocity_rad_s: Mapping[str, float] | float | None = None,
) -> Robot:
    """Return the robot in a file, measured.

    Args:
        path: MJCF or URDF.
        name: for the user.
        parts: corrections of the mapping, part -> body; the others are found.
        velocity_rad_s: limits of hinges, by name or one for all; None = the model's, else `USUAL_VELOCITY_RAD_S`.

    Raises:
        FormatError: as `read_model` and `found_parts`; an unknown part, body or joint; parts that form no limb.
    """
    read = read_model(path)
    mapping = _mapping(read, dict(parts or {}))
    tree = Tree(read.model)
    body = {part: tree.names.index(named) for part, named in mapping.items()}
    points, ankles, axes = _points(path, tree, body)
    collides = bool((read.model.geom_contype | read.model.geom_conaffinity).any())
    active = _active(tree, [body for body, _ in points.values()])
    model = _with_sites(read, tree, points, active)
    centre = 0.5 * (points["left_hip"][1] + points["right_hip"][1])
    floor = min(points[f"{side}_{corner}"][1][2] for side in SIDES for corner in CORNERS)
    origin = np.array([centre[0], centre[1], floor])
    at_rest = np.array([points[point][1] for point in POINTS]) - origin
    ankle = ankles - origin
    lengths = {
        "thigh": _mean_length(at_rest, "hip", "knee"),
        "shank": _mean_length(at_rest, "knee", "ankle"),
        "upper_arm": _mean_length(at_rest, "shoulder", "elbow"),
        "forearm": _mean_length(at_rest, "elbow", "hand"),
    }  # fmt: skip
    short = [limb for limb, length in lengths.items() if length < 0.01]
    if short:
        raise FormatError(
            "robot.no_length", "{path}: {limb} has no length; correct the mapping", path=path, limb=short[0]
        )
    bent = _bent(tree, body, axes, read.range_rad)
    return Robot(
        name=name,
        parts=mapping,
        model=model,
        joint_names=read.joint_names,
        range_rad=read.range_rad,
        velocity_rad_s=_velocities(read, velocity_rad_s),
        torque_nm=torque_limits(read.model),
        unlimited=read.unlimited,
        active=active,
        rest=np.clip(0.0, *bent.T),
        bent_rad=bent,
        site_ids=np.array([model.site(f"studio_{point}").id for point in POINTS]),
        base_m=tree.data.xpos[1] - origin,
        at_rest_m=at_rest,
        ankle_m=ankle,
        lengths_m=lengths,
        bend_axes=axes,
        collides=collides,
    )


def _mapping(read: ReadModel, given: dict[str, str]) -> dict[str, str]:
    names = [read.model.body(k).name for k in range(1, read.model.nbody)]
    for part, name in given.items():
        if part not in PARTS:
            raise FormatError(
                "robot.no_part",
                "mapping: {part!r} is no part; allowed are {allowed}",
                part=part,
                allowed=[*PARTS],
            )
        if name not in names:
            raise FormatError(
                "robot.no_body", "mapping: {part} is {body!r}, but {path} has {allowed}",
                part=part, body=name, path=read.path, allowed=names,
            )  # fmt: skip
    if set(given) == set(PARTS):
        return {part: given[part] for part in PARTS}
    return found_parts(read.path, read.model) | given


def _points(
    path: Path, tree: Tree, body: dict[str, int]
) -> tuple[dict[str, tuple[int, Array]], Array, dict[str, Array]]:
    """Body and zero-pose position of each of `POINTS`; the ankles; and the axes of knees and elbows."""
    out: dict[str, tuple[int, Array]] = {}
    axes: dict[str, Array] = {}
    ankles = []
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        for limb, root in (("leg", "pelvis"), ("arm", "torso")):
            first, middle, last = (f"{side}_{part}" for part in LIMBS[limb])
            if body[middle] not in tree.up(body[last]) or body[root] not in tree.up(body[middle]):
                raise FormatError(
                    "robot.no_limb", "mapping: {first}, {middle} and {last} do not follow each other on {root}",
                    first=first, middle=middle, last=last, root=root,
                )  # fmt: skip
            above = [one for one in tree.hinged_up(body[middle], body[root]) if one != body[middle]]
            if not above or not tree.hinged(body[middle]):
                raise FormatError(
                    "robot.no_hinge",
                    "{path}: {part} does not turn; correct the mapping",
                    path=path,
                    part=middle,
                )
            bend = tree.anchor(body[middle])
            out[middle] = body[middle], bend
            out[first] = above[-1], _centre(tree, above, bend)
            axes[middle] = _bend_axis(
                tree, body[middle], bend - out[first][1], 1.0 if limb == "arm" else -1.0
            )
        foot = body[f"{side}_foot"]
        ankles.append(tree.anchor(foot).copy())
        out[f"{side}_ankle"] = foot, ankles[-1]
        for corner, place in zip(CORNERS, _sole(tree, foot, sign), strict=True):
            out[f"{side}_{corner}"] = foot, place
        hand, elbow = body[f"{side}_hand"], tree.anchor(body[f"{side}_elbow"])
        place = _hand_place(tree, side, hand, elbow)
        thumb = np.cross(axes[f"{side}_elbow"], place - elbow)
        out[f"{side}_hand"] = hand, place
        out[f"{side}_thumb"] = hand, place + THUMB_M * thumb / max(float(np.linalg.norm(thumb)), 1e-9)
    hips, shoulders = (
        0.5 * (out[f"left_{part}"][1] + out[f"right_{part}"][1]) for part in ("hip", "shoulder")
    )
    out["pelvis_up"] = body["pelvis"], hips + np.array([0.0, 0.0, LEVER_M])
    out["torso_front"] = body["torso"], shoulders + np.array([LEVER_M, 0.0, 0.0])
    out["head_front"] = body["head"], np.array([LEVER_M, 0.0, 0.0]) + tree.anchor(body["head"])
    return out, np.array(ankles), axes


def _centre(tree: Tree, above: list[int], bend: Array) -> Array:
    """Centre of a hip or shoulder: the joint with the most lateral axis, moved along this axis to the knee's or
    elbow's lateral position."""
    joints = [tree.model.body_jntadr[one] + tree.model.body_jntnum[one] - 1 for one in above]
    joint = max(joints, key=lambda one: abs(tree.data.xaxis[one, 1]))
    axis, anchor = tree.data.xaxis[joint], tree.data.xanchor[joint]
    if abs(axis[1]) < 0.5:
        return anchor.copy()
    aside = (bend[1] - anchor[1]) / axis[1]
    if abs(aside) > SIDEWAYS * float(np.linalg.norm(bend - anchor)):  # the limb itself lies along the axis
        return anchor.copy()
    return anchor + axis * aside


def _bend_axis(tree: Tree, body: int, above: Array, ahead: float) -> Array:
    """Axis about which a knee bends back or an elbow ahead (`ahead` -1 or 1); if unclear, towards its larger range.

    Args:
        above: the bone above the joint in the zero pose, shape (3,).
    """
    joint = tree.model.body_jntadr[body] + tree.model.body_jntnum[body] - 1
    axis = tree.data.xaxis[joint]
    way = ahead * float(np.cross(axis, above)[0]) / max(float(np.linalg.norm(above)), 1e-9)
    if abs(way) < 0.3:
        low, high = tree.model.jnt_range[joint]
        way = low + high
    return axis * (1.0 if way >= 0.0 else -1.0)


def _sole(tree: Tree, foot: int, sign: float) -> Array:
    """Corners of the rectangle around a sole in the zero pose [m], as in `CORNERS`, shape (4, 3)."""
    points = surface_points(tree.model, tree.data, tree.below(foot))
    if not len(points):
        points = tree.anchor(foot) + np.array([[-0.05, -0.03, -0.03], [0.12, 0.03, -0.03]])
    low = points[:, 2].min()
    sole = points[points[:, 2] < low + SOLE_M]
    (back, right), (front, left) = sole[:, :2].min(axis=0), sole[:, :2].max(axis=0)
    inner, outer = (right, left) if sign > 0.0 else (left, right)
    return np.array([[x, y, low] for x in (back, front) for y in (inner, outer)])


def _hand_place(tree: Tree, side: str, hand: int, elbow: Array) -> Array:
    """Position of a hand: a site with such a name, else inside the end of the arm."""
    model, below = tree.model, tree.below(hand)
    for site in range(model.nsite):
        name = model.site(site).name.lower()
        if model.site_bodyid[site] in below and any(word in name for word in ("palm", "hand", "wrist")):
            mujoco.mj_kinematics(model, tree.data)
            return tree.data.site_xpos[site].copy()
    points = surface_points(model, tree.data, below)
    if not len(points):
        return tree.data.xipos[hand].copy()
    far = points[np.argmax(np.linalg.norm(points - elbow, axis=1))]
    middle = points.mean(axis=0)
    way = middle - elbow
    length = float(np.linalg.norm(far - elbow))
    return elbow + way / max(float(np.linalg.norm(way)), 1e-9) * HAND_SHARE * length


def _with_sites(
    read: ReadModel, tree: Tree, points: dict[str, tuple[int, Array]], active: NDArray[np.bool_]
) -> mujoco.MjModel:
    bodies = {body.name: body for body in read.spec.bodies}
    for point in POINTS:
        body, place = points[point]
        turn = tree.data.xmat[body].reshape(3, 3)
        local = turn.T @ (place - tree.data.xpos[body])
        bodies[tree.names[body]].add_site(name=f"studio_{point}", pos=local, group=5)
    with_floor(read.spec, read.model, active)
    return compiled(read.path, read.spec)


def _mean_length(at_rest: Array, first: str, last: str) -> float:
    ways = [at_rest[INDEX[f"{side}_{last}"]] - at_rest[INDEX[f"{side}_{first}"]] for side in SIDES]
    return float(np.linalg.norm(ways, axis=1).mean())


def _bent(tree: Tree, body: dict[str, int], axes: dict[str, Array], range_rad: Array) -> Array:
    """Limits that keep knees and elbows on the side to which they bend."""
    out = range_rad.copy()
    for side in SIDES:
        for first, middle, last in LIMBS.values():
            bend, end = body[f"{side}_{middle}"], body[f"{side}_{last}"]
            joint = tree.model.body_jntadr[bend] + tree.model.body_jntnum[bend] - 1
            axis, at = tree.data.xaxis[joint], tree.anchor(bend)
            above = tree.anchor(body[f"{side}_{first}"]) - at
            beyond = (tree.anchor(end) if end != bend else tree.data.xipos[end]) - at
            flat = [way - (way @ axis) * axis for way in (-above, beyond)]
            straight = float(np.arctan2(np.cross(flat[1], flat[0]) @ axis, flat[1] @ flat[0]))
            low, high = range_rad[joint - 1]
            if axis @ axes[f"{side}_{middle}"] > 0.0:
                out[joint - 1, 0] = np.clip(straight + BENT_RAD, low, high)
            else:
                out[joint - 1, 1] = np.clip(straight - BENT_RAD, low, high)
    return out


def _active(tree: Tree, bodies: list[int]) -> NDArray[np.bool_]:
    moved = {one for body in bodies for one in tree.up(body)}
    return np.array([int(tree.model.jnt_bodyid[k]) in moved for k in range(1, tree.model.njnt)])


def _velocities(read: ReadModel, given: Mapping[str, float] | float | None) -> Array:
    out = np.where(np.isfinite(read.velocity_rad_s), read.velocity_rad_s, USUAL_VELOCITY_RAD_S)
    if isinstance(given, Mapping):
        unknown = sorted(set(given) - set(read.joint_names))
        if unknown:
            raise FormatError(
                "robot.no_joint", "{path} has no joint {name!r}", path=read.path, name=unknown[0]
            )
        for name, limit in given.items():
            out[read.joint_names.index(name)] = limit
    elif given is not None:
        out[:] = given
    if not (np.isfinite(out) & (out > 0.0)).all():
        raise FormatError("robot.velocity", "a joint's velocity limit must be above 0 rad/s")
    return out


__all__ = ["CORNERS", "FREE", "FREE_DOFS", "INDEX", "POINTS", "Robot", "build_robot"]
