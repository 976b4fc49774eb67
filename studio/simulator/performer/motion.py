"""A performer's motion: joints, rotations of all bones, hands and head over time."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.animation.motion.canonical import canonical_joints
from studio.engine.animation.motion.keys import RATE_HZ
from studio.engine.animation.motion.motion import CanonicalMotion, Motion
from studio.engine.animation.read.files import read_animation
from studio.engine.base.quaternions import continuous_signs, normalized
from studio.engine.model.joints import CANONICAL, INDEX
from studio.simulator.body.bones import BONE
from studio.simulator.body.performers import Actor
from studio.simulator.body.pose import bone_rotations
from studio.simulator.body.proportions import carried_over, performer_offsets
from studio.simulator.motion import DEMO, has_rest_frame, stage_motion
from studio.simulator.performer.acting import hand_changes, head_turns

Array = NDArray[np.float64]

# Joint to which the bone that starts at the key points.
_NEXT = {f"{side}_{a}": f"{side}_{b}" for side in ("left", "right")
         for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", "hand"),
                      ("hip", "knee"), ("knee", "ankle"), ("ankle", "toe"))}  # fmt: skip


@dataclass(frozen=True)
class PerformerMotion:
    """A performer's motion on the stage.

    Attributes:
        motion: joints and hands; its positions are the truth.
        rotations_wxyz: rotation of every bone of the body from the T-pose, shape (F, BODY_BONES, 4); signs continuous
            over time.
        calibration_s: length of the calibration part; None = there is none.
        enters_s: entrance of the performer [s]; absent before it.
    """

    motion: CanonicalMotion
    rotations_wxyz: Array
    calibration_s: float | None = None
    enters_s: float = 0.0

    @property
    def head_wxyz(self) -> Array:
        """The head's rotation from the T-pose, in which it faces -y, shape (F, 4)."""
        return self.rotations_wxyz[:, BONE["head"]]

    def moved(self, x_m: float, y_m: float) -> "PerformerMotion":
        """Return the motion at another place on the floor."""
        positions = self.motion.positions_m + np.array([x_m, y_m, 0.0])
        return replace(self, motion=replace(self.motion, positions_m=positions))

    def at(self, time_s: float) -> tuple[Array, Array]:
        """Return joints [m], shape (21, 3), and bone rotations, wxyz, shape (BODY_BONES, 4), at a time."""
        place = min(max(time_s / self.motion.frame_s, 0.0), self.motion.frame_count - 1.0)
        first = int(place)
        after = min(first + 1, self.motion.frame_count - 1)
        share = place - first
        turn = (1 - share) * self.rotations_wxyz[first] + share * self.rotations_wxyz[after]
        return self.motion.at(time_s), normalized(turn)


def perform(
    motion: CanonicalMotion,
    performer: Actor,
    *,
    turned: Array | None = None,
    calibration_s: float | None = None,
    acts: bool = True,
    enters_s: float = 0.0,
) -> PerformerMotion:
    """Return a motion retargeted to a performer's body.

    Args:
        motion: on the stage, with its own skeleton.
        performer: sets the proportions.
        turned: bone rotations from the T-pose, shape (F, 21, 3, 3); NaN = unknown.
        calibration_s, enters_s: see `PerformerMotion`.
        acts: the performer looks about, and opens and closes the hands where the motion keeps them open.
    """
    offsets = performer_offsets(performer)
    positions = carried_over(motion.positions_m, motion.offsets_m, offsets, turned)
    rotations = bone_rotations(positions, offsets, turned)
    hands = motion.hands_open
    if acts:
        rng = np.random.default_rng([performer.seed, 7])
        times = motion.times_s()
        looks, changes = head_turns(times, rng), hand_changes(times, rng)
        still = times < (calibration_s or 0.0)
        looks[still & (times < 3.5)] = np.eye(3)
        changes[still] = 1.0
        rotations = _looking(rotations, looks)
        hands = np.minimum(hands, changes) if (hands == 1).all() else hands
    done = replace(motion, positions_m=positions, offsets_m=offsets, hands_open=hands)
    return PerformerMotion(done, _steady(rotations), calibration_s, enters_s)


def read_performance(
    path: str | Path, performer: Actor, *, unit_m: float | None = None, calibration: bool = True
) -> PerformerMotion:
    """Return an animation's motion, or `demo`, with a performer's body on the stage, after the calibration part.

    Raises:
        FormatError: see `simulator.motion.stage_motion`.
    """
    motion, calibration_s = stage_motion(path, unit_m=unit_m, calibration=calibration)
    if str(path) == DEMO:
        own = demo_motion().hands_open
        hands = np.concatenate([np.ones((motion.frame_count - len(own), 2)), own])
        return perform(replace(motion, hands_open=hands), performer, calibration_s=calibration_s)
    turned = np.full((motion.frame_count, len(CANONICAL), 3, 3), np.nan)
    source = read_animation(path, unit_m=unit_m)
    if isinstance(source, Motion) and (rotations := _file_rotations(source, motion.offsets_m)) is not None:
        before = 0 if calibration_s is None else round(calibration_s * RATE_HZ)
        count = motion.frame_count - before
        index = np.round(np.arange(count) / RATE_HZ / source.frame_s).astype(int) + has_rest_frame(path)
        turned[before:] = rotations[np.minimum(index, source.frame_count - 1)]
    return perform(motion, performer, turned=turned, calibration_s=calibration_s)


def _file_rotations(source: Motion, offsets_m: Array) -> Array | None:
    """Rotations from the T-pose of the bone that starts at each canonical joint, shape (F, 21, 3, 3).

    The file's rotations are relative to its own rest pose; None if that pose is not upright.
    """
    joints = canonical_joints(source)
    rest = source.rest_m
    up = rest[joints["head"]] - 0.5 * (rest[joints["left_ankle"]] + rest[joints["right_ankle"]])
    if up[2] < 0.8 * np.linalg.norm(up):
        return None
    across = (rest[joints[f"left_{j}"]] - rest[joints[f"right_{j}"]] for j in ("hip", "shoulder"))
    lateral = sum(across, start=np.zeros(3))
    to_rest = Rotation.from_euler("z", np.arctan2(lateral[1], lateral[0])).as_matrix()
    out = np.empty((source.frame_count, len(CANONICAL), 3, 3))
    for name in CANONICAL:
        align = to_rest
        if name in _NEXT and name in joints and _NEXT[name] in joints:
            way = rest[joints[_NEXT[name]]] - rest[joints[name]]
            own = to_rest @ offsets_m[INDEX[_NEXT[name]]]
            if np.linalg.norm(way) > 1e-6:
                align = Rotation.align_vectors(way[None], own[None])[0].as_matrix() @ to_rest
        out[:, INDEX[name]] = source.rotations[:, joints.get(name, joints["hips"])] @ align
    return out


def _looking(rotations: Array, looks: Array) -> Array:
    """Bone rotations with the head turned further by `looks`, and the neck by half of it."""
    out = rotations.copy()
    head, neck = BONE["head"], BONE["neck"]
    out[:, head] = rotations[:, head] @ looks
    half = Rotation.from_rotvec(0.5 * Rotation.from_matrix(looks, assume_valid=True).as_rotvec()).as_matrix()
    out[:, neck] = rotations[:, neck] @ half
    return out


def _steady(rotations: Array) -> Array:
    """Quaternions wxyz, shape (F, B, 4), with signs continuous over time."""
    flat = Rotation.from_matrix(rotations.reshape(-1, 3, 3), assume_valid=True).as_quat(scalar_first=True)
    return continuous_signs(flat.reshape(*rotations.shape[:2], 4))
