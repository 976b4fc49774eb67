"""From channels over time to the joints of a body: trunk and arms by forward, legs by inverse kinematics.

Channels (`Keys`), all 0 in a relaxed stand with the arms hanging straight down:
    drop, back                   hips lower, or further back, than standing [m]
    lean, bend, twist            pelvis forwards, chest further forwards, chest turned to the left [rad]
    nod                          head forwards [rad]
    tiptoe                       heels up, both feet [rad]
    <side>_raise, <side>_plane   upper arm raised from hanging, in a plane: 0 = aside, pi/2 = forwards [rad]
    <side>_spread                the raised or hanging arm moved aside [rad]
    <side>_roll, <side>_elbow    upper arm turned about itself, elbow bent [rad]
    <side>_fist                  1 = the hand is a fist
    swing                        share of arm swing while walking
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial.transform import Rotation

from studio.engine.animation.motion.gait import Feet, step_after
from studio.engine.animation.motion.keys import RATE_HZ, FloorPath, Keys
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.animation.motion.proportions import TOE_HEIGHT_M
from studio.engine.model.joints import INDEX

Array = NDArray[np.float64]
_SIDES = ("left", "right")
_LEG_STRETCH = 0.998  # of the leg's length, so that a knee never becomes straight
_SOFT_KNEES_M = 0.004


def compose(offsets: Array, keys: Keys, path: FloorPath, duration_s: float) -> CanonicalMotion:
    """Return the motion of a body with T-pose `offsets`, shape (21, 3), from time 0 to `duration_s`."""
    times = np.arange(round(duration_s * RATE_HZ) + 1) / RATE_HZ
    channel = {name: keys.sample(name, times) for name in keys.channels}
    channel["lift"] = sum((jump.lift(times) for jump in keys.jumps), np.zeros(len(times)))
    channel["rise"] = sum((jump.rise(times) for jump in keys.jumps), np.zeros(len(times)))
    zero = np.zeros(len(times))

    def get(name: str) -> Array:
        return channel.get(name, zero)

    place, yaw = path.sample(times)
    feet = step_after(times, place, yaw, _standing_toes(offsets))
    toes, ankles = _ankles(offsets, feet, get("tiptoe"), get("lift"))
    stride = _stride(feet, place, yaw)  # left foot before right [m]
    pelvis = _turn(yaw - 0.12 * stride, get("lean"))
    positions = np.empty((len(times), len(offsets), 3))
    positions[:, 0] = _hips(offsets, place, yaw, pelvis, feet, ankles, get)
    turn = yaw + get("twist") + 0.12 * stride
    spine = _turn(turn, get("lean") + 0.5 * get("bend"))
    chest = _turn(turn, get("lean") + get("bend"))
    head = _turn(yaw + 0.6 * get("twist"), 0.4 * get("lean") + 0.4 * get("bend") + get("nod"))
    for joint, parent, rotation in (
        ("spine", "hips", pelvis), ("chest", "spine", spine),
        ("neck", "chest", chest), ("head", "neck", head),
        ("left_hip", "hips", pelvis), ("right_hip", "hips", pelvis),
        ("left_shoulder", "chest", chest), ("right_shoulder", "chest", chest),
    ):  # fmt: skip
        positions[:, INDEX[joint]] = positions[:, INDEX[parent]] + rotation @ offsets[INDEX[joint]]
    for i, side in enumerate(_SIDES):
        swing = get("swing") * 0.75 * stride * (-1.0, 1.0)[i]
        arm = [get(f"{side}_{name}") for name in ("raise", "plane", "roll", "elbow", "spread")]
        _arm(positions, offsets, side, chest, arm, swing)
        _leg(positions, offsets, side, feet.yaws[:, i], yaw, toes[:, i], ankles[:, i])
    fists = np.stack([get(f"{side}_fist") for side in _SIDES], axis=-1)
    return CanonicalMotion(1 / RATE_HZ, positions, offsets, np.clip(1 - fists, 0.0, 1.0))


def _standing_toes(offsets: Array) -> Array:
    return np.array(
        [sum(offsets[INDEX[f"{s}_{j}"], :2] for j in ("hip", "knee", "ankle", "toe")) for s in _SIDES]
    )


def _turn(yaw: Array, forwards: Array) -> Array:
    """Rotations by a heading and a lean forwards (towards -y at yaw 0), shape (F, 3, 3)."""
    return Rotation.from_euler("ZX", np.stack([yaw, forwards], axis=-1)).as_matrix()


def _stride(feet: Feet, place: Array, yaw: Array) -> Array:
    forward = np.stack([np.sin(yaw), -np.cos(yaw)], axis=-1)
    return ((feet.toes_m[:, 0, :2] - feet.toes_m[:, 1, :2]) * forward).sum(axis=-1)


def _ankles(offsets: Array, feet: Feet, tiptoe: Array, lift: Array) -> tuple[Array, Array]:
    """Toe and ankle joints [m], shape (F, 2, 3); the foot turns about its toes."""
    toes = feet.toes_m.copy()
    toes[..., 2] += TOE_HEIGHT_M + lift[:, None]
    ankles = np.empty_like(toes)
    for i, side in enumerate(_SIDES):
        rotation = _turn(feet.yaws[:, i], feet.pitches[:, i] + tiptoe)
        ankles[:, i] = toes[:, i] - rotation @ offsets[INDEX[f"{side}_toe"]]
    return toes, ankles


def _hips(
    offsets: Array,
    place: Array,
    yaw: Array,
    pelvis: Array,
    feet: Feet,
    ankles: Array,
    get: Callable[[str], Array],
) -> Array:
    """The hips [m], shape (F, 3): at the requested height, but within reach of both legs."""
    sway = 0.35 * (feet.toes_m[:, 1, 2] - feet.toes_m[:, 0, 2])  # over the standing foot
    aside = np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
    forward = np.stack([np.sin(yaw), -np.cos(yaw)], axis=-1)
    sway = gaussian_filter1d(sway, 0.08 * RATE_HZ, mode="nearest")
    hips = np.empty((len(place), 3))
    hips[:, :2] = place + sway[:, None] * aside - get("back")[:, None] * forward
    reach = np.full(len(place), np.inf)
    for i, side in enumerate(_SIDES):
        length = sum(np.linalg.norm(offsets[INDEX[f"{side}_{j}"]]) for j in ("knee", "ankle")) * _LEG_STRETCH
        hip = pelvis @ offsets[INDEX[f"{side}_hip"]]
        across = np.hypot(*(hips[:, :2] + hip[:, :2] - ankles[:, i, :2]).T)
        room = np.sqrt(np.maximum(length**2 - across**2, (0.3 * length) ** 2))
        reach = np.minimum(reach, ankles[:, i, 2] + room - hip[:, 2])
    lift = get("lift")
    wanted = offsets[0, 2] - _SOFT_KNEES_M - get("drop") + get("rise")
    excess = np.maximum(wanted + lift - reach, 0.0)
    half = round(0.06 * RATE_HZ)
    excess = maximum_filter1d(excess, 2 * half + 1, mode="nearest")
    hips[:, 2] = wanted + lift - gaussian_filter1d(excess, half / 2, radius=half, mode="nearest")
    return hips


def _arm(positions: Array, offsets: Array, side: str, chest: Array, arm: list[Array], swing: Array) -> None:
    """Set elbow, wrist and hand. The arm hangs down at 0; its elbow bends forwards."""
    raise_, plane, roll, elbow, spread = arm
    sign = 1.0 if side == "left" else -1.0
    # rotation of the raise: about the axis that turns "down" towards the plane's direction
    direction = np.stack([sign * np.cos(plane), -np.sin(plane), np.zeros_like(plane)], axis=-1)
    axis = np.cross(np.array([0.0, 0.0, -1.0]), direction)
    raised = Rotation.from_rotvec(axis * raise_[:, None])
    if spread.any():
        raised = Rotation.from_rotvec(np.array([0.0, -sign, 0.0]) * spread[:, None]) * raised
    swung = Rotation.from_rotvec(np.array([-1.0, 0.0, 0.0]) * swing[:, None])
    down = np.array([0.0, 0.0, -1.0])
    upper_rotation = swung * raised * Rotation.from_rotvec(down * (sign * roll)[:, None])
    bend = elbow + 0.5 * np.maximum(swing, 0.0)
    fore_rotation = upper_rotation * Rotation.from_rotvec(np.array([-1.0, 0.0, 0.0]) * bend[:, None])
    upper = (chest @ upper_rotation.apply(down)[..., None])[..., 0]
    fore = (chest @ fore_rotation.apply(down)[..., None])[..., 0]
    lengths = [np.linalg.norm(offsets[INDEX[f"{side}_{joint}"]]) for joint in ("elbow", "wrist", "hand")]
    shoulder = positions[:, INDEX[f"{side}_shoulder"]]
    positions[:, INDEX[f"{side}_elbow"]] = shoulder + lengths[0] * upper
    positions[:, INDEX[f"{side}_wrist"]] = shoulder + lengths[0] * upper + lengths[1] * fore
    positions[:, INDEX[f"{side}_hand"]] = shoulder + lengths[0] * upper + (lengths[1] + lengths[2]) * fore


def _leg(
    positions: Array, offsets: Array, side: str, foot_yaw: Array, yaw: Array, toes: Array, ankles: Array
) -> None:
    """Set knee, ankle and toe: the knee bends forwards, between the headings of foot and body."""
    thigh, shin = (float(np.linalg.norm(offsets[INDEX[f"{side}_{joint}"]])) for joint in ("knee", "ankle"))
    hip = positions[:, INDEX[f"{side}_hip"]]
    way = ankles - hip
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    down = way / distance
    reach = np.minimum(distance, (thigh + shin) * 0.9995)
    heading = 0.5 * (foot_yaw + yaw)
    forward = np.stack([np.sin(heading), -np.cos(heading), np.zeros_like(heading)], axis=-1)
    forward -= (forward * down).sum(axis=-1, keepdims=True) * down
    forward /= np.linalg.norm(forward, axis=-1, keepdims=True)
    along = (thigh**2 - shin**2 + reach**2) / (2 * reach)
    out = np.sqrt(np.maximum(thigh**2 - along**2, 0.0))
    positions[:, INDEX[f"{side}_knee"]] = hip + along * down + out * forward
    positions[:, INDEX[f"{side}_ankle"]] = ankles
    positions[:, INDEX[f"{side}_toe"]] = toes
