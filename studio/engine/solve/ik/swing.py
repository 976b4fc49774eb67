"""A pose without inverse kinematics: world rotations of the bodies from the directions of the joints.

`ik=none` uses it for rotations, and the solve for its first guess. A limb's twist comes from the plane of its elbow
or knee; a straight limb swings from its parent without twist.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import cross, rotation_between
from studio.engine.model.human.humanoid import BODY_JOINTS, Humanoid
from studio.engine.model.human.ranges import dofs_of
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX, OUTPUT_INDEX, OUTPUT_JOINTS, OUTPUT_OF_CANONICAL, OUTPUT_PARENTS

BEND_MIN_SINE = 0.25
"""Below this bend (the sine of the angle) a limb's twist is not observable."""

PLANE_MIN_SINE = 1e-3
"""Two directions with a smaller angle (its sine) do not span a plane."""


def _frame(up: NDArray[np.float64], left: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Rotation whose z is along `up` and whose x is nearest to `left`; None where they do not span a plane."""
    up_length, left_length = math.sqrt(up @ up), math.sqrt(left @ left)
    if not (up_length > 1e-6 and left_length > 1e-6):
        return None
    z = up / up_length
    x = left / left_length
    x = x - (x @ z) * z
    sine = math.sqrt(x @ x)
    if not sine > PLANE_MIN_SINE:
        return None
    x = x / sine
    return np.column_stack([x, cross(z, x), z])


def _aligned(rest_up: NDArray[np.float64], rest_left: NDArray[np.float64], up: NDArray[np.float64],
             left: NDArray[np.float64]) -> NDArray[np.float64] | None:  # fmt: skip
    rest, now = _frame(rest_up, rest_left), _frame(up, left)
    return None if rest is None or now is None else now @ rest.T


def _limb(
    parent: NDArray[np.float64], rest: tuple[NDArray[np.float64], ...], now: tuple[NDArray[np.float64], ...],
    bend_axis: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """Rotations of an upper and a lower limb from joint positions (root, middle, end) at rest and now."""
    if np.isnan(now[0]).any() or np.isnan(now[1]).any():
        return parent, parent
    upper_rest, upper = rest[1] - rest[0], now[1] - now[0]
    swing = rotation_between(parent @ upper_rest, upper) @ parent
    if np.isnan(now[2]).any():
        return swing, swing
    lower_rest, lower = rest[2] - rest[1], now[2] - now[1]
    hinge = cross(upper, lower)
    sine = math.sqrt(hinge @ hinge) / max(math.sqrt(upper @ upper) * math.sqrt(lower @ lower), 1e-9)
    if sine > BEND_MIN_SINE:
        turned = _aligned(upper_rest, bend_axis, upper, hinge)
        swing = swing if turned is None else turned
    return swing, rotation_between(swing @ lower_rest, lower) @ swing


def _between(a: NDArray[np.float64], b: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """The rotation between two others, at a share of the way."""
    turn = Rotation.from_matrix(a.T @ b, assume_valid=True).as_rotvec()
    return a @ Rotation.from_rotvec(share * turn).as_matrix()


def swing_rotations(skeleton: Skeleton, joints: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return world rotations of the output joints, shape (52, 3, 3), that point along canonical joints.

    Args:
        skeleton: the performer at rest.
        joints: canonical joints [m], shape (21, 3), stage frame; NaN = unseen.

    Returns:
        None where too few joints of hips, shoulders and trunk are seen.
    """
    p = {name: joints[i] for name, i in INDEX.items()}
    rest = {name: skeleton.rest_positions_m[OUTPUT_INDEX[o]] for name, o in OUTPUT_OF_CANONICAL.items()}
    up_rest, up = rest["neck"] - rest["hips"], p["neck"] - p["hips"]
    hips = _aligned(up_rest, rest["left_hip"] - rest["right_hip"], up, p["left_hip"] - p["right_hip"])
    chest = _aligned(
        rest["neck"] - rest["chest"], rest["left_shoulder"] - rest["right_shoulder"],
        p["neck"] - (p["chest"] if np.isfinite(p["chest"]).all() else p["hips"]),
        p["left_shoulder"] - p["right_shoulder"],
    )  # fmt: skip
    hips = chest if hips is None or np.isnan(hips).any() else hips
    chest = hips if chest is None or np.isnan(chest).any() else chest
    if hips is None or chest is None or np.isnan(hips).any():
        return None
    rotations = np.tile(chest, (len(OUTPUT_JOINTS), 1, 1))

    def put(name: str, rotation: NDArray[np.float64]) -> None:
        rotations[OUTPUT_INDEX[name]] = rotation

    put("Hips", hips)
    put("Spine", _between(hips, chest, 1.0 / 3.0))
    put("Spine1", _between(hips, chest, 2.0 / 3.0))
    neck = p["head"] - p["neck"]
    if np.isfinite(neck).all():
        swing = rotation_between(chest @ (rest["head"] - rest["neck"]), neck) @ chest
        put("Neck", swing)
        put("Head", swing)
    for side, x in (("left", 1.0), ("right", -1.0)):
        name = side.capitalize()
        for upper, lower, end, parts, parent, axis in (
            (
                "Arm",
                "ForeArm",
                "Hand",
                ("shoulder", "elbow", "wrist", "hand"),
                chest,
                np.array([0.0, 0.0, -x]),
            ),
            ("UpLeg", "Leg", "Foot", ("hip", "knee", "ankle", "toe"), hips, np.array([1.0, 0.0, 0.0])),
        ):
            keys = [f"{side}_{part}" for part in parts]
            a, b = _limb(parent, tuple(rest[k] for k in keys[:3]), tuple(p[k] for k in keys[:3]), axis)
            put(name + upper, a)
            put(name + lower, b)
            last = p[keys[3]] - p[keys[2]]
            put(
                name + end,
                b
                if np.isnan(last).any()
                else rotation_between(b @ (rest[keys[3]] - rest[keys[2]]), last) @ b,
            )
    for joint, output in enumerate(OUTPUT_JOINTS):  # fingers and toes move with the hand and the foot
        if output.endswith("ToeBase") or ("Hand" in output and not output.endswith("Hand")):
            rotations[joint] = rotations[OUTPUT_PARENTS[joint]]
    return rotations


def _needed() -> dict[str, tuple[str, ...]]:
    """Canonical joints that determine each output joint's rotation; the trunk's are always seen."""
    needed: dict[str, tuple[str, ...]] = {"Neck": ("neck", "head"), "Head": ("neck", "head")}
    for side in ("left", "right"):
        for names, joints in (
            (("Arm", "ForeArm", "Hand"), ("shoulder", "elbow", "wrist", "hand")),
            (("UpLeg", "Leg", "Foot"), ("hip", "knee", "ankle", "toe")),
        ):
            for k, name in enumerate(names):
                needed[side.capitalize() + name] = tuple(f"{side}_{joint}" for joint in joints[: k + 2])
        needed[f"{side.capitalize()}ToeBase"] = needed[f"{side.capitalize()}Foot"]
    return needed


class ShownHinges:
    """Tells which hinges `swing_rotations` reads from joints; it leaves the others straight."""

    def __init__(self, humanoid: Humanoid) -> None:
        rows, needed = [], _needed()
        for name in BODY_JOINTS[1:]:
            row = np.zeros(len(INDEX), dtype=bool)
            row[[INDEX[joint] for joint in needed.get(name, ())]] = True
            rows += [row] * len(dofs_of(name))
        self._needed = np.array(rows)  # (hinge_count, 21)
        assert len(self._needed) == len(humanoid.range_rad)

    def shown(self, joints: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return whether joints, shape (21, 3), NaN = unseen, determine each hinge, shape (hinge_count,)."""
        return ~np.logical_or.reduce(self._needed & np.isnan(joints[:, 0]), axis=1)
