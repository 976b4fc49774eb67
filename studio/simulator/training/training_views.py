"""Depth images of hands and heads of random performers in random poses, to train the small networks of the engine.

Poses are frames of the mocap clips for tuning, with arms, hands and heads turned at random. Performers are those for
tuning and random bodies between them. Only the part of the image around a hand or head is rendered.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.base.geometry import invert_transform, transform_points, unit
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.joints import INDEX
from studio.simulator.body.bones import BONE
from studio.simulator.body.mesh import make_body
from studio.simulator.body.performers import TUNING, Actor
from studio.simulator.performer.figure import Figure
from studio.simulator.performer.motion import PerformerMotion, perform
from studio.simulator.sensor.camera import SimulatedDepthCamera
from studio.simulator.sensor.room import Room
from studio.simulator.sensor.sensors import SENSORS

Array = NDArray[np.float64]

SIDE_M = 0.60
"""Width of the rendered part of the image."""

_FRAME_S = 1.0 / 30
_SENSORS = ("kinect-v2", "azure-kinect")
_FRONT = np.array([0.0, -1.0, 0.0])
_TWIST_DEG = 100.0
"""Largest twist of forearms to either side."""

_LOOK_DEG = np.array([35.0, 15.0, 65.0])
"""Largest turns of heads up and down, sideways tilt, and to the side, from the neck's direction. The neck leans
further than the chest, and the head with it.
"""

_MOVED = 0.5
"""Share of the arms with a random pose."""


@dataclass(frozen=True)
class TrainingView:
    """The part of a depth image around a hand or the head.

    Attributes:
        what: `left`, `right` or `head`.
        camera: of this part.
        depth_mm: shape (camera.height, camera.width).
        joints: canonical joints in the camera frame [m], shape (21, 3).
        openness: of the hand, 1 = open, 0 = fist.
        R_camera_head: the head's rotation from the T-pose, in the camera frame, shape (3, 3).
        performer: index of the performer, for data splits.
    """

    what: str
    camera: DepthCamera
    depth_mm: NDArray[np.uint16]
    joints: Array
    openness: float
    R_camera_head: Array
    performer: int


def training_views(
    clips: tuple[CanonicalMotion, ...],
    performers: int,
    poses: int,
    rng: np.random.Generator,
    kinds: tuple[str, ...] = ("left", "right", "head"),
    *,
    aside_deg: float = 75.0,
) -> Iterator[TrainingView]:
    """Yield views of hands and heads.

    Args:
        clips: source of the poses.
        performers: number of bodies.
        poses: number per body.
        rng: random generator.
        kinds: kinds of views.
        aside_deg: largest angle of the camera from the performer's front, to either side.
    """
    for number in range(performers):
        performer = _random_performer(rng)
        motion = _turned(perform(_random_poses(clips, poses, rng), performer, acts=False), rng)
        body = make_body(performer, motion.motion.offsets_m)
        figure = Figure(body, motion)
        for pose in range(poses):
            yield from _views(figure, motion, pose, number, rng, kinds, aside_deg)


def _random_performer(rng: np.random.Generator) -> Actor:
    performer = TUNING[rng.integers(len(TUNING))]
    return replace(
        performer,
        name="random",
        height_m=rng.uniform(0.95, 2.0) if rng.random() < 0.8 else performer.height_m,
        girth=performer.girth * rng.uniform(0.9, 1.1),
        head=performer.head * rng.uniform(0.93, 1.1),
        hair=str(rng.choice(["none", "short", "bob", "tail"])),
        hand=rng.uniform(0.87, 1.1),
        finger=rng.uniform(0.87, 1.1),
        sleeve=rng.uniform(0.6, 2.0),
        seed=int(rng.integers(1000, 10_000)),
    )


def _random_poses(
    clips: tuple[CanonicalMotion, ...], count: int, rng: np.random.Generator
) -> CanonicalMotion:
    """Frames of the clips, facing -y at the origin, with some arms moved; hands open or closed."""
    poses = []
    for _ in range(count):
        clip = clips[rng.integers(len(clips))]
        joints = clip.positions_m[rng.integers(clip.frame_count)].copy()
        joints[:, :2] -= joints[INDEX["hips"], :2]
        across = joints[INDEX["left_shoulder"]] - joints[INDEX["right_shoulder"]]
        joints = joints @ Rotation.from_euler("z", -np.arctan2(across[1], across[0])).as_matrix().T
        for side, sign in (("left", 1.0), ("right", -1.0)):
            if rng.random() < _MOVED:
                _move_arm(joints, side, sign, rng)
        poses.append(joints)
    closed = rng.random((count, 2)) < 0.5
    hands = np.where(closed, rng.uniform(0.0, 0.15, (count, 2)), rng.uniform(0.85, 1.0, (count, 2)))
    return CanonicalMotion(_FRAME_S, np.array(poses), clips[0].offsets_m, hands)


def _move_arm(joints: Array, side: str, sign: float, rng: np.random.Generator) -> None:
    """Give an arm a random direction, mostly to the front and its own side, with the hand along the forearm."""
    chain = [INDEX[f"{side}_{joint}"] for joint in ("shoulder", "elbow", "wrist", "hand")]
    lengths = [np.linalg.norm(joints[b] - joints[a]) for a, b in pairwise(chain)]
    upper = unit(rng.normal(size=3) + 0.7 * _FRONT + np.array([0.5 * sign, 0.0, -0.4]))
    fore = unit(upper + rng.choice([0.3, 1.0]) * rng.normal(size=3) + rng.uniform(0, 1) * _FRONT)
    hand = unit(fore + 0.25 * rng.normal(size=3))
    for k, way in enumerate((upper, fore, hand)):
        joints[chain[k + 1]] = joints[chain[k]] + lengths[k] * way


def _turned(motion: PerformerMotion, rng: np.random.Generator) -> PerformerMotion:
    """The motion with twisted hands and a turned head."""
    turns = motion.rotations_wxyz.copy()
    joints = motion.motion.positions_m
    for side in ("left", "right"):
        way = joints[:, INDEX[f"{side}_hand"]] - joints[:, INDEX[f"{side}_wrist"]]
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        twist = Rotation.from_rotvec(way * np.radians(rng.uniform(-_TWIST_DEG, _TWIST_DEG, (len(way), 1))))
        _turn(turns, f"{side}_hand", lambda now, twist=twist: twist * now)
    look = Rotation.from_euler("xyz", rng.uniform(-_LOOK_DEG, _LOOK_DEG, (len(turns), 3)), degrees=True)
    along_neck = Rotation.from_quat(turns[:, BONE["neck"]], scalar_first=True)
    _turn(turns, "head", lambda _: along_neck * look)
    _turn(turns, "neck", lambda now: now * Rotation.from_rotvec(0.5 * look.as_rotvec()))
    return replace(motion, rotations_wxyz=turns)


def _turn(turns: Array, bone: str, change) -> None:
    now = Rotation.from_quat(turns[:, BONE[bone]], scalar_first=True)
    turns[:, BONE[bone]] = change(now).as_quat(scalar_first=True)


def _views(
    figure: Figure,
    motion: PerformerMotion,
    pose: int,
    number: int,
    rng: np.random.Generator,
    kinds: tuple[str, ...],
    aside_deg: float,
) -> Iterator[TrainingView]:
    sensor = SENSORS[_SENSORS[rng.integers(len(_SENSORS))]]
    joints = motion.motion.positions_m[pose]
    T_stage_camera = _standpoint(joints, rng, aside_deg)
    T_camera_stage = invert_transform(T_stage_camera)
    in_camera = transform_points(T_camera_stage, joints)
    head_wxyz = motion.rotations_wxyz[pose, BONE["head"]]
    R_camera_head = T_camera_stage[:3, :3] @ Rotation.from_quat(head_wxyz, scalar_first=True).as_matrix()
    room = Room.around(np.concatenate([joints, T_stage_camera[None, :3, 3]]))
    for what in kinds:
        middle = (
            in_camera[INDEX["head"]] - [0, 0.06, 0] if what == "head" else in_camera[INDEX[f"{what}_hand"]]
        )
        part = _part(sensor.camera, middle)
        if part is None:
            continue
        camera = SimulatedDepthCamera(replace(sensor, camera=part), T_stage_camera, (figure,), room, rng)
        openness = motion.motion.hands_open[pose, 1 if what == "right" else 0]
        depth_mm = camera.image(pose * _FRAME_S + 1e-9)
        yield TrainingView(what, part, depth_mm, in_camera, float(openness), R_camera_head, number)


def _standpoint(joints: Array, rng: np.random.Generator, aside_deg: float) -> Array:
    """A camera at 1.3 to 3.7 m that looks at the body, up to `aside_deg` from its front, shape (4, 4)."""
    turn = np.radians(rng.uniform(-aside_deg, aside_deg))
    distance_m = rng.uniform(1.3, 3.7)
    eye = np.array([distance_m * np.sin(turn), -distance_m * np.cos(turn), rng.uniform(0.6, 2.1)])
    target = joints[INDEX["chest"]] + rng.normal(0.0, 0.15, 3)
    z = unit(target - eye)
    x = unit(np.cross(z, [0.0, 0.0, 1.0]))
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    T[:3, 3] = eye
    return T


def _part(camera: DepthCamera, middle: Array) -> DepthCamera | None:
    """Camera of the image part around a place; None if the place is out of view."""
    if middle[2] < 0.4:
        return None
    column, row = np.rint(camera.pixels_of(middle)).astype(int)
    size = round(SIDE_M * camera.fx / middle[2])
    left, top = max(column - size // 2, 0), max(row - size // 2, 0)
    width, height = min(column + size // 2, camera.width) - left, min(row + size // 2, camera.height) - top
    if width < size // 2 or height < size // 2:
        return None
    part = replace(camera, cx=camera.cx - left, cy=camera.cy - top, width=width, height=height)
    part.__dict__["rays"] = camera.rays[
        top : top + height, left : left + width
    ]  # computed once for the whole
    return part
