"""A performer's motion as a robot needs it: joints, rotations of the parts, lengths, and stances on the floor."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.errors import FormatError
from studio.engine.base.quaternions import rotate
from studio.engine.model.poses import Poses
from studio.engine.whole_take.finish.contact.contacts import find_contacts

Array = NDArray[np.float64]

SIDES = ("Left", "Right")
LIMBS = tuple(
    f"{side}{part}" for side in SIDES for part in ("UpLeg", "Leg", "Foot", "Arm", "ForeArm", "Hand")
)
FEET = tuple(f"{side}{part}" for side in SIDES for part in ("Foot", "ToeBase"))
CHEST, HEAD = ("Spine2", "Spine1", "Spine", "Hips"), ("Head", "Neck", "Spine2", "Hips")
"""Joints that give the rotation of chest and head, the best one first."""

_TOE = np.array([0.0, -0.15, -0.06])
"""Offset from the ankle of a toe that the skeleton lacks, in the T-pose [m]."""

LEAST_FRAMES = 4
_LOW_PERCENT = 5.0
"""Percentile of a joint's height that replaces its standing height where it never stands."""


@dataclass(frozen=True)
class Performed:
    """A performer's motion on a uniform clock, floor at z = 0. Axes are those of the stage.

    Attributes:
        time_s: shape (frame_count,).
        frame_s: time between frames [s].
        at: joint -> positions [m], shape (frame_count, 3).
        turned: hips, chest, head, and each foot and hand -> rotations from the T-pose, wxyz, shape (frame_count, 4).
        feet_rest: for each side the constant rotation between a foot and a flat foot, wxyz, shape (2, 4).
        hold: 0 = free .. 1 = stands, of left ankle and toe, right ankle and toe, shape (frame_count, 4).
        stand_m: heights of those joints where they stand [m], shape (4,).
        lengths_m: thigh, shank, upper_arm, forearm, hip_width, trunk.
    """

    time_s: Array
    frame_s: float
    at: dict[str, Array]
    turned: dict[str, Array]
    feet_rest: Array
    hold: Array
    stand_m: Array
    lengths_m: dict[str, float]

    @property
    def leg_m(self) -> float:
        """Length of a straight leg from hip to sole [m]."""
        return self.lengths_m["thigh"] + self.lengths_m["shank"] + float(self.stand_m[[0, 2]].mean())

    def part(self, rows: slice) -> "Performed":
        """The motion in some frames."""
        return replace(
            self,
            time_s=self.time_s[rows],
            at={name: places[rows] for name, places in self.at.items()},
            turned={name: turns[rows] for name, turns in self.turned.items()},
            hold=self.hold[rows],
        )

    def middle(self, part: str) -> Array:
        """Middle between the left and the right joint [m], shape (frame_count, 3)."""
        return 0.5 * (self.at[f"Left{part}"] + self.at[f"Right{part}"])


def performed(poses: Poses) -> Performed:
    """Return the motion of poses on a uniform clock.

    Raises:
        FormatError: a limb is missing, or there are too few frames.
    """
    index = {name: k for k, name in enumerate(poses.joint_names)}
    missing = [name for name in ("Hips", *LIMBS) if name not in index]
    if missing:
        raise FormatError(
            "robot.motion_lacks",
            "the motion has no {names}: a robot needs hips, arms and legs; rename its joints",
            names=missing,
        )
    if poses.frame_count < LEAST_FRAMES:
        raise FormatError(
            "robot.motion_short",
            "the motion has {n} frames; a robot needs {least}",
            n=poses.frame_count,
            least=LEAST_FRAMES,
        )
    at = {name: poses.positions_m[:, index[name]].copy() for name in ("Hips", *LIMBS)}
    turned = {
        "Hips": poses.rotations_wxyz[:, index["Hips"]],
        "Chest": poses.rotations_wxyz[:, _nearest(index, CHEST)],
        "Head": poses.rotations_wxyz[:, _nearest(index, HEAD)],
    }
    for name in LIMBS:
        turned[name] = poses.rotations_wxyz[:, index[name]]
    for side in SIDES:
        toe = f"{side}ToeBase"
        at[toe] = (
            poses.positions_m[:, index[toe]].copy()
            if toe in index
            else at[f"{side}Foot"] + rotate(turned[f"{side}Foot"], _TOE)
        )
    return _on_floor(poses, at, turned)


def _nearest(index: dict[str, int], names: tuple[str, ...]) -> int:
    return next(index[name] for name in names if name in index)


def _on_floor(poses: Poses, at: dict[str, Array], turned: dict[str, Array]) -> Performed:
    frame_s = 1.0 / poses.frames_per_second
    feet = np.stack([at[joint] for joint in FEET], axis=1)
    low = np.percentile(feet[:, :, 2], _LOW_PERCENT, axis=0)
    hold = find_contacts(feet, [(0, len(feet))], frame_s, np.maximum(low, 1e-3)).hold
    stand = np.array(
        [np.median(feet[hold[:, k] == 1.0, k, 2]) if (hold[:, k] == 1.0).any() else low[k] for k in range(4)]
    )
    # The floor is one toe joint's height below the standing toe joints.
    floor = float(min(stand[1], stand[3])) - _toe_height(feet, stand)
    for places in at.values():
        places[:, 2] -= floor
    return Performed(
        time_s=poses.time_s[0] + np.arange(poses.frame_count) * frame_s,
        frame_s=frame_s,
        at=at,
        turned=turned,
        feet_rest=np.stack(
            [_flat_turn(turned[f"{side}Foot"], hold[:, 2 * k : 2 * k + 2]) for k, side in enumerate(SIDES)]
        ),
        hold=hold,
        stand_m=stand - floor,
        lengths_m=limb_lengths(at),
    )


TOE_OF_FOOT = 0.16
"""Height of a toe's joint over the sole, as a share of the distance from ankle to toe."""


def _toe_height(feet: Array, stand: Array) -> float:
    length = float(np.median(np.linalg.norm(feet[:, [0, 2]] - feet[:, [1, 3]], axis=2)))
    return TOE_OF_FOOT * length


def _flat_turn(turns: Array, hold: Array) -> Array:
    """Inverse of the mean rotation of a flat foot without its heading, wxyz, shape (4,)."""
    flat = (hold == 1.0).all(axis=1)
    if not flat.any():
        return np.array([1.0, 0.0, 0.0, 0.0])
    whole = Rotation.from_quat(turns[flat], scalar_first=True)
    ahead = whole.apply([0.0, -1.0, 0.0])
    heading = np.arctan2(ahead[:, 0], -ahead[:, 1])
    return (Rotation.from_euler("z", -heading[:, None]) * whole).mean().inv().as_quat(scalar_first=True)


def limb_lengths(at: dict[str, Array]) -> dict[str, float]:
    """Return a performer's `lengths_m` from positions of joints, each of the shape (frame_count, 3)."""

    def length(first: str, last: str) -> float:
        return float(
            np.mean([np.median(np.linalg.norm(at[s + last] - at[s + first], axis=1)) for s in SIDES])
        )

    def across(part: str) -> Array:
        return 0.5 * (at[f"Left{part}"] + at[f"Right{part}"])

    return {
        "thigh": length("UpLeg", "Leg"),
        "shank": length("Leg", "Foot"),
        "upper_arm": length("Arm", "ForeArm"),
        "forearm": length("ForeArm", "Hand"),
        "hip_width": float(np.median(np.linalg.norm(at["LeftUpLeg"] - at["RightUpLeg"], axis=1))),
        "trunk": float(np.median(np.linalg.norm(across("Arm") - across("UpLeg"), axis=1))),
    }
