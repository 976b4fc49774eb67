"""Targets of a robot's points: a performer's motion, scaled part by part.

The path and the legs are scaled by the ratio of leg lengths, the trunk and the arms by their own ratios. Feet keep
the robot's own width about the scaled path. A standing foot has one position and heading for its whole stance.
"""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.arrays import runs
from studio.engine.base.quaternions import multiply, rotate
from studio.engine.robots.body.parts import SIDES
from studio.engine.robots.body.robot import CORNERS, INDEX, POINTS, THUMB_M, Robot
from studio.engine.robots.moving.performed import SIDES as PERFORMER_SIDES
from studio.engine.robots.moving.performed import Performed
from studio.engine.whole_take.finish.contact.places import places_of

Array = NDArray[np.float64]

TO_STAGE = np.array([np.sqrt(0.5), 0.0, 0.0, -np.sqrt(0.5)])
"""Rotation from a robot's axes (x ahead, y left) to a performer's in the T-pose (-y ahead, x left), wxyz."""

SINK = 0.01
"""Share of the leg by which the hips are lowered, so that straight legs are not at the end of their reach."""

TURN_M = 0.15
"""Distance that equals one radian of a stance's heading [m/rad]."""

CHANGE_M2_S = 4e-3
"""Cost of a change of place in a stance (`places`)."""

TOUCH_M = (0.10, 0.25)
"""A hand keeps the performer's distance to what it touches below the first distance, and is free above the second."""

TOUCHING = (
    ("left_hand", "right_hand"),
    *(
        (f"{one}_hand", f"{other}_{part}")
        for one, other in (SIDES, SIDES[::-1])
        for part in ("elbow", "shoulder")
    ),
    *((f"{one}_hand", f"{other}_knee") for one in SIDES for other in SIDES),
)
"""Pairs of a hand and a point of the robot's own body that it may touch."""

_JOINTS = {"hand": "Hand", "elbow": "ForeArm", "shoulder": "Arm", "knee": "Leg"}

FLOOR_SIGMA_M = 0.004
"""Standard deviation of the height of a hand on the floor."""

SIGMA_M = {
    "pelvis_up": 0.06, "torso_front": 0.05, "head_front": 0.08, "hip": 0.03, "knee": 0.04, "shoulder": 0.03,
    "ankle": np.inf, "elbow": 0.03, "hand": 0.02, "thumb": 0.08, "corner": 0.02,
}  # fmt: skip
"""Standard deviation of a robot's points from their targets [m]; infinite = only measured for the figures."""

STANDS_SIGMA_M = np.array([0.0004, 0.0004, 0.001])
"""The same for corners of a standing sole, along x, y and z: a foot that cannot be flat tips rather than slides."""

SOLES = np.array([[INDEX[f"{side}_{corner}"] for corner in CORNERS] for side in SIDES])
"""Corners of the soles among a robot's points, shape (2, 4)."""

KEY_POINTS = tuple(
    f"{side}_{part}" for side in SIDES for part in ("knee", "ankle", "shoulder", "elbow", "hand")
)
"""Points whose distance from their targets is reported as a figure."""

_HIPS, _KNEES, _ANKLES, _SHOULDERS, _ELBOWS, _HANDS, _THUMBS = (
    [INDEX[f"{side}_{part}"] for side in SIDES]
    for part in ("hip", "knee", "ankle", "shoulder", "elbow", "hand", "thumb")
)
_OF_HIPS = [*_HIPS, INDEX["pelvis_up"]]
_OF_CHEST = [*_SHOULDERS, INDEX["torso_front"], INDEX["head_front"]]
_LEFT, _AHEAD = np.array([[0.0, 1.0, 0.0]]), np.array([0.2, 0.0, 0.0])
_THUMB_WAYS = np.array([[0.0, -1.0, 0.0]] * 2)
"""The hips' left, the lever of the head, and directions of the thumbs in the T-pose."""

_WHOSE = [0] * 4 + [1] * 4 + [2] + [5, 6] + [3] * 4 + [4] * 4
"""Index of the rotation of each vector of `_turned_ways`, in the order hips, chest, head, feet, hands."""

_BONES = (
    ("UpLeg", "Leg", "thigh"),
    ("Arm", "ForeArm", "upper_arm"),
    ("ForeArm", "Hand", "forearm"),
)
"""First and last joint of a performer's bones that a robot's limbs follow, and the robot's length."""


@dataclass(frozen=True)
class Targets:
    """Targets of a robot's points over time.

    Attributes:
        frame_s: time between frames [s].
        points_m: shape (frame_count, point_count, 3).
        sigma_m: standard deviation of each coordinate, shape (frame_count, point_count, 3).
        hold: how much each corner of the soles stands, 0..1, shape (frame_count, 2, 4).
        hips_wxyz, chest_wxyz: rotations of pelvis and torso from the zero pose, robot's axes, shape (frame_count, 4).
        feet_wxyz: the same for the feet, shape (frame_count, 2, 4).
        touch_m: target vector from the second of each pair of `TOUCHING` to the first [m], shape (frame_count,
            pair_count, 3).
        touching: weight of that vector, 0..1, shape (frame_count, pair_count).
    """

    frame_s: float
    points_m: Array
    sigma_m: Array
    hold: Array
    hips_wxyz: Array
    chest_wxyz: Array
    feet_wxyz: Array
    touch_m: Array
    touching: Array

    def __len__(self) -> int:
        return len(self.points_m)

    @property
    def standing(self) -> NDArray[np.bool_]:
        """Corners that stand fully, shape (frame_count, 2, 4)."""
        return self.hold >= 1.0

    def part(self, rows: slice) -> "Targets":
        """The targets of some frames."""
        arrays = [field.name for field in fields(self) if field.name != "frame_s"]
        return replace(self, **{name: getattr(self, name)[rows] for name in arrays})


def targets_of(robot: Robot, motion: Performed) -> Targets:
    """Return the targets of a robot's points in each frame of a performer's motion, with standing feet in place."""
    targets = scaled(robot, motion)
    hold = corner_hold(motion.hold)
    soles = targets.points_m[:, SOLES]
    _plant(robot, motion.frame_s, soles, soles.copy(), hold, slice(0, len(soles)))
    targets.points_m[:, SOLES] = soles
    targets.sigma_m[:, SOLES] = sole_sigma_m(hold)
    touch, touching = _touches(motion, _arm_ratio(robot, motion))
    return replace(targets, hold=hold, touch_m=touch, touching=touching)


def _arm_ratio(robot: Robot, motion: Performed) -> float:
    """Return the ratio of the robot's arm length to the performer's."""
    own, theirs = (
        sum(of[part] for part in ("upper_arm", "forearm")) for of in (robot.lengths_m, motion.lengths_m)
    )
    return own / theirs


def scaled(robot: Robot, motion: Performed) -> Targets:
    """Return the targets of a robot's points in each frame of a performer's motion, without stances and touches."""
    ratio = robot.leg_m / motion.leg_m
    frames = len(motion.time_s)
    turns = _turns(motion)
    hips_turn, chest_turn, _, left_foot, right_foot = turns.swapaxes(0, 1)
    ways = _turned_ways(robot, motion, turns)
    points = np.empty((frames, len(POINTS), 3))
    hips = ratio * motion.middle("UpLeg")
    hips[:, 2] -= SINK * robot.leg_m
    points[:, _OF_HIPS] = hips[:, None] + ways[:, :3]
    trunk_m = float(np.linalg.norm(np.subtract(*_middles(robot))))
    shoulders = hips + _directions(motion.middle("Arm") - motion.middle("UpLeg"), trunk_m)
    points[:, _OF_CHEST] = shoulders[:, None] + ways[:, 4:8]
    points[:, INDEX["head_front"]] += ways[:, 8]
    _limbs(robot, motion, points)
    points[:, _THUMBS] = points[:, _HANDS] + THUMB_M * ways[:, 9:11]
    ankles = _ankles(robot, motion, ways[:, 3], ratio)
    points[:, _ANKLES] = ankles
    soles = ankles[:, :, None] + ways[:, 11:].reshape(frames, 2, len(CORNERS), 3)
    soles[..., 2] -= np.minimum(soles[..., 2].min(axis=2, keepdims=True), 0.0)  # none below the floor
    points[:, SOLES] = soles
    sigma = np.tile(_SIGMA_M[:, None], (frames, 1, 3))
    _hands_on_floor(motion, _arm_ratio(robot, motion), points, sigma)
    return Targets(
        frame_s=motion.frame_s,
        points_m=points,
        sigma_m=sigma,
        hold=np.zeros((frames, 2, 4)),
        hips_wxyz=hips_turn,
        chest_wxyz=chest_turn,
        feet_wxyz=np.stack([left_foot, right_foot], axis=1),
        touch_m=np.zeros((frames, len(TOUCHING), 3)),
        touching=np.zeros((frames, len(TOUCHING))),
    )


def _turns(motion: Performed) -> Array:
    """Rotations of hips, chest, head and both feet from a robot's zero pose, wxyz, shape (frame_count, 5, 4)."""
    feet = [motion.turned[f"{theirs}Foot"] for theirs in PERFORMER_SIDES]
    turns = np.stack([*(motion.turned[part] for part in ("Hips", "Chest", "Head")), *feet], axis=1)
    turns[:, 3:] = multiply(turns[:, 3:], motion.feet_rest)
    return multiply(turns, TO_STAGE)


def _turned_ways(robot: Robot, motion: Performed, turns: Array) -> Array:
    """Vectors on a robot's parts, rotated like the performer's parts [m], shape (frame_count, 19, 3): from the hips'
    middle to `_OF_HIPS`, the hips' left, from the shoulders' middle to `_OF_CHEST`, the head's lever, the thumbs'
    levers, and from the ankles to the corners of the soles. One call for all, as a live frame's arrays are small."""
    rest = robot.at_rest_m
    hips, shoulders = _middles(robot)
    of_chest = rest[_OF_CHEST]
    of_chest[-1] -= _AHEAD
    of_chest -= shoulders
    soles = (rest[SOLES] - robot.ankle_m[:, None]).reshape(-1, 3)
    ways = np.concatenate([rest[_OF_HIPS] - hips, _LEFT, of_chest, _AHEAD[None], _THUMB_WAYS, soles])
    hands = np.stack([motion.turned[f"{theirs}Hand"] for theirs in PERFORMER_SIDES], axis=1)
    whose = np.concatenate([turns, hands], axis=1)[:, _WHOSE]
    return rotate(whose, ways)


def _middles(robot: Robot) -> tuple[Array, Array]:
    """Middles of a robot's hips and shoulders in its zero pose [m], each of the shape (3,)."""
    rest = robot.at_rest_m
    return 0.5 * (rest[_HIPS[0]] + rest[_HIPS[1]]), 0.5 * (rest[_SHOULDERS[0]] + rest[_SHOULDERS[1]])


def _directions(ways: Array, length_m: Array | float) -> Array:
    """Vectors of given lengths in the directions of `ways`, shape (..., 3)."""
    return ways * (length_m / np.maximum(np.linalg.norm(ways, axis=-1, keepdims=True), 1e-9))


def _limbs(robot: Robot, motion: Performed, points: Array) -> None:
    """Set knees, elbows and hands, from hips and shoulders."""
    at = motion.at
    bones = np.stack(
        [at[side + last] - at[side + first] for first, last, _ in _BONES for side in PERFORMER_SIDES], axis=1
    )
    lengths = np.repeat([robot.lengths_m[name] for _, _, name in _BONES], 2)
    ways = _directions(bones, lengths[:, None])
    points[:, _KNEES] = points[:, _HIPS] + ways[:, :2]
    points[:, _ELBOWS] = points[:, _SHOULDERS] + ways[:, 2:4]
    points[:, _HANDS] = points[:, _ELBOWS] + ways[:, 4:]


def _ankles(robot: Robot, motion: Performed, left: Array, ratio: float) -> Array:
    """Places of the ankles [m], shape (frame_count, 2, 3); `left`: the hips' left, shape (frame_count, 3)."""
    left = left * [1.0, 1.0, 0.0]
    left /= np.maximum(np.linalg.norm(left, axis=1, keepdims=True), 1e-9)
    apart = np.linalg.norm(robot.at_rest_m[_HIPS[0]] - robot.at_rest_m[_HIPS[1]])
    wider = 0.5 * (float(apart) - ratio * motion.lengths_m["hip_width"])
    feet = np.stack([motion.at[f"{theirs}Foot"] for theirs in PERFORMER_SIDES], axis=1)
    ankles = ratio * feet + np.array([[wider], [-wider]]) * left[:, None]
    ankles[..., 2] = robot.ankle_m[:, 2] + ratio * (feet[..., 2] - motion.stand_m[[0, 2]])
    return ankles


def corner_hold(hold: Array) -> Array:
    """Return how much each corner of the soles stands: the heel's as the performer's ankle, the toes' as the toe."""
    heels, toes = hold[:, [0, 2], None], hold[:, [1, 3], None]
    return np.concatenate([heels, heels, toes, toes], axis=2)


def _plant(robot: Robot, frame_s: float, soles: Array, seen: Array, hold: Array, rows: slice) -> None:
    """Place standing soles, in place, at one position on the floor for each stance that begins in the rows.

    Args:
        soles: corners, shape (frame_count, 2, 4, 3).
        seen: corners in the rows from which the position of a stance is taken, shape (row_count, 2, 4, 3).
        hold: how much the corners stand, shape (frame_count, 2, 4).
    """
    low, high = rows.start, rows.stop
    for k in range(2):
        local = sole_of(robot, k)
        for begin, end in runs(hold[:, k].max(axis=1) > 0.0):
            if not low <= begin < high:
                continue
            until = min(end, high)
            own = hold[begin:until, k]
            pose = np.column_stack(flat_pose(local, seen[begin - low : until - low, k], own[:, 2] > 0.0))
            pose[:, 2] = TURN_M * np.unwrap(pose[:, 2])
            path = _of_sure(pose, own.max(axis=1) >= 1.0)
            place = places_of(path, frame_s, change_m2_s=CHANGE_M2_S)
            place = np.concatenate([place, np.repeat(place[-1:], end - until, axis=0)])
            planted = flat_sole(local, place[:, :2], place[:, 2] / TURN_M)
            stands = hold[begin:end, k, :, None] > 0.0
            soles[begin:end, k] = np.where(stands, planted, soles[begin:end, k])


def replanted(robot: Robot, targets: Targets, points_m: Array, rows: slice) -> Targets:
    """Return the targets with each stance that begins in the rows moved to where the robot's foot is, and each
    standing sole in the rows tilted as the robot's, its lowest corner on the floor.

    A robot may not reach all positions at once, or be flat there: its legs are less free than the performer's.

    Args:
        points_m: the robot's points in the rows, shape (row_count, point_count, 3).
    """
    points = targets.points_m.copy()
    soles = points[:, SOLES]
    seen = points_m[:, SOLES]
    _plant(robot, targets.frame_s, soles, seen, targets.hold, rows)
    soles[rows, ..., 2] = np.where(
        targets.hold[rows] > 0.0, tilt_heights(seen, targets.hold[rows]), soles[rows, ..., 2]
    )
    points[:, SOLES] = soles
    return replace(targets, points_m=points)


def tilt_heights(soles: Array, hold: Array) -> Array:
    """Return heights of sole corners over the lower corner of their heel or toe, times how much they stand [m].

    Args:
        soles: corners, shape (frame_count, 2, 4, 3).
        hold: how much the corners stand, shape (frame_count, 2, 4).
    """
    edges = soles[..., 2].reshape(-1, 2, 2, 2)
    return hold * (edges - edges.min(axis=3, keepdims=True)).reshape(hold.shape)


def _of_sure(path: Array, sure: NDArray[np.bool_]) -> Array:
    """Return the path with each unsure frame replaced by the nearest sure one."""
    known = np.flatnonzero(sure)
    if not len(known):
        return path
    return path[known[np.abs(np.arange(len(path))[:, None] - known).argmin(axis=1)]]


def sole_of(robot: Robot, side: int) -> Array:
    """Return the corners of a sole from its ankle, on the floor [m], shape (4, 2)."""
    return (robot.at_rest_m[SOLES[side]] - robot.ankle_m[side])[:, :2]


def flat_pose(local: Array, corners: Array, by_toe: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return where a foot's ankle would be on the floor [m], shape (frame_count, 2), and its heading [rad].

    Args:
        local: `sole_of` the foot.
        corners: of its sole, shape (frame_count, 4, 3).
        by_toe: True = the toe's edge stays when the foot becomes flat, False = the heel's, shape (frame_count,).
    """
    ahead = (corners[:, 2:] - corners[:, :2]).sum(axis=1)
    heading = np.arctan2(ahead[:, 1], ahead[:, 0])
    choose = by_toe[:, None]
    seen = np.where(choose, corners[:, 2:, :2].mean(axis=1), corners[:, :2, :2].mean(axis=1))
    edge = np.where(choose, local[2:].mean(axis=0), local[:2].mean(axis=0))
    return seen - _turned(heading, edge[:, None])[:, 0], heading


def flat_sole(local: Array, ankle_m: Array, heading: Array) -> Array:
    """Return the corners of flat soles on the floor [m], shape (frame_count, 4, 3)."""
    out = np.zeros((len(ankle_m), 4, 3))
    out[..., :2] = ankle_m[:, None] + _turned(heading, local[None])
    return out


def _turned(yaw: Array, local: Array) -> Array:
    """Return vectors on the floor, shape (1 or frame_count, count, 2), rotated by headings, shape (frame_count,)."""
    c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    return np.stack([c * local[..., 0] - s * local[..., 1], s * local[..., 0] + c * local[..., 1]], axis=-1)


def _touches(motion: Performed, ratio: float) -> tuple[Array, Array]:
    """Return the vectors between touching points of the performer, at the robot's size, and the weight of each."""
    ways = np.stack([_joint(motion, first) - _joint(motion, second) for first, second in TOUCHING], axis=1)
    return ratio * ways, _nearness(np.linalg.norm(ways, axis=2))


def _hands_on_floor(motion: Performed, ratio: float, points: Array, sigma: Array) -> None:
    """Bring hands to the floor, in place, where the performer's hands are on it."""
    height = np.stack([motion.at[f"{theirs}Hand"][:, 2] for theirs in PERFORMER_SIDES], axis=1)
    near = _nearness(np.maximum(height, 0.0))
    points[:, _HANDS, 2] += near * (ratio * height - points[:, _HANDS, 2])
    sigma[:, _HANDS, 2] *= (FLOOR_SIGMA_M / SIGMA_M["hand"]) ** near


def _joint(motion: Performed, point: str) -> Array:
    """Return the performer's joint at a point of a robot [m], shape (frame_count, 3)."""
    side, part = point.split("_")
    return motion.at[PERFORMER_SIDES[SIDES.index(side)] + _JOINTS[part]]


def _nearness(distance_m: Array) -> Array:
    """Return 1 for touching .. 0 for free, smooth in between."""
    near, far = TOUCH_M
    t = np.clip((distance_m - far) / (near - far), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def sole_sigma_m(hold: Array) -> Array:
    """Return the standard deviation of corners from their targets for how much they stand [m], shape (..., 3)."""
    loose = SIGMA_M["corner"]
    return loose * (STANDS_SIGMA_M / loose) ** hold[..., None]


def _sigmas() -> Array:
    parts = [point.split("_", 1)[1] if point.startswith(SIDES) else point for point in POINTS]
    return np.array([SIGMA_M["corner" if part in CORNERS else part] for part in parts])


_SIGMA_M = _sigmas()
