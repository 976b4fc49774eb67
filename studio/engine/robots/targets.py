"""Where a robot's points shall be: a performer's motion, scaled part by part.

The path and the legs are scaled by the ratio of leg lengths, the trunk and the arms by their own. Feet keep the
robot's own width beside the scaled path. A standing foot has one place and one heading for its whole stance.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.quaternions import multiply, rotate
from studio.engine.robots.performed import SIDES as PERFORMER_SIDES
from studio.engine.robots.performed import Performed
from studio.engine.robots.robot import CORNERS, INDEX, POINTS, THUMB_M, Robot
from studio.engine.robots.parts import SIDES
from studio.engine.whole_take.finish.places import places_of

Array = NDArray[np.float64]

TO_STAGE = np.array([np.sqrt(0.5), 0.0, 0.0, -np.sqrt(0.5)])
"""Turn from a robot's axes (x ahead, y left) to a performer's in the T-pose (-y ahead, x left), wxyz."""

SINK = 0.01
"""The hips are lowered by this share of the leg, so that straight legs are not at the end of their reach."""

TURN_M = 0.15
"""A stance's heading counts as a place at this distance [m/rad]."""

CHANGE_M2_S = 4e-3
"""Cost of a change of place in a stance (`places`)."""

HANDS_M = (0.10, 0.25)
"""Hands are as near to each other as the performer's below the first distance, and free of it above the second."""

SIGMA_M = {
    "pelvis_up": 0.06, "torso_front": 0.05, "head_front": 0.08, "hip": 0.03, "knee": 0.04, "shoulder": 0.03,
    "ankle": np.inf, "elbow": 0.03, "hand": 0.02, "thumb": 0.08, "corner": 0.02,
}  # fmt: skip
"""Standard deviation of a robot's points from their targets [m]; infinite = only a figure is made of it."""

STANDS_SIGMA_M = 0.001
"""Of the corners of a standing sole."""

KEY_POINTS = tuple(
    f"{side}_{part}" for side in SIDES for part in ("knee", "ankle", "shoulder", "elbow", "hand")
)
"""Points whose distance from their targets is a figure."""


@dataclass(frozen=True)
class Targets:
    """Targets of a robot's points over time.

    Attributes:
        frame_s: time between frames [s].
        points_m: shape (frame_count, point_count, 3).
        sigma_m: standard deviation of each coordinate, shape (frame_count, point_count, 3).
        hold: how much each corner of the soles stands, 0..1, shape (frame_count, 2, 4).
        hips_wxyz, chest_wxyz: turns of pelvis and torso from the zero pose, robot's axes, shape (frame_count, 4).
        feet_wxyz: of the feet, shape (frame_count, 2, 4).
        hands_m: wanted way from the right hand to the left [m], shape (frame_count, 3).
        together: how much that counts, 0..1, shape (frame_count,).
    """

    frame_s: float
    points_m: Array
    sigma_m: Array
    hold: Array
    hips_wxyz: Array
    chest_wxyz: Array
    feet_wxyz: Array
    hands_m: Array
    together: Array

    def __len__(self) -> int:
        return len(self.points_m)

    @property
    def standing(self) -> NDArray[np.bool_]:
        """Corners that stand fully, shape (frame_count, 2, 4)."""
        return self.hold >= 1.0

    def part(self, rows: slice) -> "Targets":
        """The targets of some frames."""
        return Targets(self.frame_s, *(getattr(self, name)[rows] for name in self.__annotations__ if name != "frame_s"))


def targets_of(robot: Robot, motion: Performed) -> Targets:
    """Return where a robot's points shall be in each frame of a performer's motion."""
    ratio = robot.leg_m / motion.leg_m
    frames = len(motion.time_s)
    points = np.empty((frames, len(POINTS), 3))
    hips_turn, chest_turn = (multiply(motion.turned[part], TO_STAGE) for part in ("Hips", "Chest"))
    rest = robot.at_rest_m
    hips_rest = 0.5 * (rest[INDEX["left_hip"]] + rest[INDEX["right_hip"]])
    shoulders_rest = 0.5 * (rest[INDEX["left_shoulder"]] + rest[INDEX["right_shoulder"]])
    hips = ratio * motion.middle("UpLeg")
    hips[:, 2] -= SINK * robot.leg_m
    for point in ("left_hip", "right_hip", "pelvis_up"):
        points[:, INDEX[point]] = hips + rotate(hips_turn, rest[INDEX[point]] - hips_rest)
    trunk_m = float(np.linalg.norm(shoulders_rest - hips_rest))
    shoulders = hips + _directions(motion.middle("Arm") - motion.middle("UpLeg"), trunk_m)
    for point in ("left_shoulder", "right_shoulder", "torso_front"):
        points[:, INDEX[point]] = shoulders + rotate(chest_turn, rest[INDEX[point]] - shoulders_rest)
    head_turn = multiply(motion.turned["Head"], TO_STAGE)
    ahead = np.array([0.2, 0.0, 0.0])
    head = shoulders + rotate(chest_turn, rest[INDEX["head_front"]] - ahead - shoulders_rest)
    points[:, INDEX["head_front"]] = head + rotate(head_turn, ahead)
    for side, theirs in zip(SIDES, PERFORMER_SIDES, strict=True):
        _limb(robot, motion, points, side, theirs)
    ankles, feet = _ankles(robot, motion, hips_turn, ratio)
    points[:, [INDEX["left_ankle"], INDEX["right_ankle"]]] = ankles
    hold = _corner_hold(motion)
    soles = _soles(robot, ankles, feet)
    _plant(robot, motion, soles, feet, hold)
    for k, side in enumerate(SIDES):
        first = INDEX[f"{side}_{CORNERS[0]}"]
        points[:, first : first + 4] = soles[:, k]
    hands, together = _hands(robot, motion, points)
    return Targets(
        frame_s=motion.frame_s,
        points_m=points,
        sigma_m=_sigma(frames, hold),
        hold=hold,
        hips_wxyz=hips_turn,
        chest_wxyz=chest_turn,
        feet_wxyz=feet,
        hands_m=hands,
        together=together,
    )


def _directions(ways: Array, length_m: float) -> Array:
    """Ways of a given length in the directions of others, shape (frame_count, 3)."""
    return ways * (length_m / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9))


def _limb(robot: Robot, motion: Performed, points: Array, side: str, theirs: str) -> None:
    """Set the knee, elbow, hand and thumb of a side, from its hip and shoulder."""
    at, lengths = motion.at, robot.lengths_m

    def way(first: str, last: str, length: str) -> Array:
        return _directions(at[theirs + last] - at[theirs + first], lengths[length])

    points[:, INDEX[f"{side}_knee"]] = points[:, INDEX[f"{side}_hip"]] + way("UpLeg", "Leg", "thigh")
    elbow = points[:, INDEX[f"{side}_shoulder"]] + way("Arm", "ForeArm", "upper_arm")
    hand = elbow + way("ForeArm", "Hand", "forearm")
    points[:, INDEX[f"{side}_elbow"]], points[:, INDEX[f"{side}_hand"]] = elbow, hand
    thumb = rotate(motion.turned[f"{theirs}Hand"], np.array([0.0, -1.0, 0.0]))
    points[:, INDEX[f"{side}_thumb"]] = hand + THUMB_M * thumb


def _ankles(robot: Robot, motion: Performed, hips_turn: Array, ratio: float) -> tuple[Array, Array]:
    """Places of the ankles [m], shape (frame_count, 2, 3), and turns of the feet, shape (frame_count, 2, 4)."""
    ankles = np.empty((len(motion.time_s), 2, 3))
    feet = np.empty((len(motion.time_s), 2, 4))
    left = rotate(hips_turn, np.array([0.0, 1.0, 0.0]))
    left[:, 2] = 0.0
    left /= np.maximum(np.linalg.norm(left, axis=1, keepdims=True), 1e-9)
    apart = np.linalg.norm(robot.at_rest_m[INDEX["left_hip"]] - robot.at_rest_m[INDEX["right_hip"]])
    wider = 0.5 * (float(apart) - ratio * motion.lengths_m["hip_width"])
    for k, (theirs, sign) in enumerate(zip(PERFORMER_SIDES, (1.0, -1.0), strict=True)):
        ankles[:, k] = ratio * motion.at[f"{theirs}Foot"] + sign * wider * left
        ankles[:, k, 2] = robot.ankle_m[k, 2] + ratio * (motion.at[f"{theirs}Foot"][:, 2] - motion.stand_m[2 * k])
        feet[:, k] = multiply(multiply(motion.turned[f"{theirs}Foot"], motion.feet_rest[k]), TO_STAGE)
    return ankles, feet


def _soles(robot: Robot, ankles: Array, feet: Array) -> Array:
    """Corners of the soles [m], shape (frame_count, 2, 4, 3), none of them below the floor."""
    out = np.empty((len(ankles), 2, 4, 3))
    for k, side in enumerate(SIDES):
        first = INDEX[f"{side}_{CORNERS[0]}"]
        local = robot.at_rest_m[first : first + 4] - robot.ankle_m[k]
        out[:, k] = ankles[:, k, None] + rotate(feet[:, k, None], local)
    out[..., 2] -= np.minimum(out[..., 2].min(axis=2, keepdims=True), 0.0)
    return out


def _corner_hold(motion: Performed) -> Array:
    """How much each corner stands: heels as the performer's ankle, toes as the toe."""
    heels, toes = motion.hold[:, [0, 2], None], motion.hold[:, [1, 3], None]
    return np.concatenate([heels, heels, toes, toes], axis=2)


def _plant(robot: Robot, motion: Performed, soles: Array, feet: Array, hold: Array) -> None:
    """Put the corners of standing soles, in place, at one place on the floor for each stance."""
    ahead = rotate(feet, np.array([1.0, 0.0, 0.0]))
    heading = np.arctan2(ahead[..., 1], ahead[..., 0])
    for k, side in enumerate(SIDES):
        first = INDEX[f"{side}_{CORNERS[0]}"]
        local = (robot.at_rest_m[first : first + 4] - robot.ankle_m[k])[:, :2]
        stands = hold[:, k].max(axis=1) > 0.0
        for begin, end in runs(stands):
            rows = slice(begin, end)
            yaw = np.unwrap(heading[rows, k])
            by_toe = (hold[rows, k, 2] > 0.0)[:, None]
            seen = np.where(by_toe, soles[rows, k, 2:, :2].mean(axis=1), soles[rows, k, :2, :2].mean(axis=1))
            edge = np.where(by_toe, local[2:].mean(axis=0), local[:2].mean(axis=0))
            origin = seen - _turned(yaw, edge[:, None])[:, 0]
            path = np.column_stack([origin, TURN_M * yaw])
            trusted = hold[rows, k].max(axis=1) >= 1.0
            if trusted.any():
                path[~trusted] = path[np.flatnonzero(trusted)[np.abs(np.flatnonzero(~trusted)[:, None] - np.flatnonzero(trusted)).argmin(axis=1)]]
            place = places_of(path, motion.frame_s, change_m2_s=CHANGE_M2_S)
            planted = np.zeros((end - begin, 4, 3))
            planted[..., :2] = place[:, None, :2] + _turned(place[:, 2] / TURN_M, local[None])
            here = hold[rows, k, :, None] > 0.0
            soles[rows, k] = np.where(here, planted, soles[rows, k])


def _turned(yaw: Array, local: Array) -> Array:
    """Vectors on the floor, shape (1 or frame_count, count, 2), turned by headings, shape (frame_count,)."""
    c, s = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    return np.stack([c * local[..., 0] - s * local[..., 1], s * local[..., 0] + c * local[..., 1]], axis=-1)


def runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Begin and end of each run of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _hands(robot: Robot, motion: Performed, points: Array) -> tuple[Array, Array]:
    """The way between the hands where they are near each other, and how much it counts."""
    way = motion.at["LeftHand"] - motion.at["RightHand"]
    ratio = (robot.lengths_m["upper_arm"] + robot.lengths_m["forearm"]) / (
        motion.lengths_m["upper_arm"] + motion.lengths_m["forearm"]
    )
    near, far = HANDS_M
    t = np.clip((np.linalg.norm(way, axis=1) - far) / (near - far), 0.0, 1.0)
    return ratio * way, t * t * (3.0 - 2.0 * t)


def _sigma(frames: int, hold: Array) -> Array:
    """Standard deviations of the points' coordinates [m], shape (frame_count, point_count, 3)."""
    out = np.empty((frames, len(POINTS), 3))
    for point, k in INDEX.items():
        part = point.split("_", 1)[-1] if point.startswith(SIDES) else point
        out[:, k] = SIGMA_M["corner" if part in CORNERS else part]
    for k, side in enumerate(SIDES):
        first = INDEX[f"{side}_{CORNERS[0]}"]
        loose = SIGMA_M["corner"]
        out[:, first : first + 4] = (loose * (STANDS_SIGMA_M / loose) ** hold[:, k])[..., None]
    return out
