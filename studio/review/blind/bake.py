"""The animations of a test: both of a pair on one character, at 60 Hz, different in the motion only.

The character keeps its bone lengths and gets a solve's world rotations and hip path. Several performers are all
shown, in the same colours on both sides. A voter receives an uncompressed GLB without a name. The two files of a
pair have the same size and the same bytes, except for the values of the keys.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

from studio.engine.animation.clip.skeleton import LocalMotion, local_motion, to_file_axes
from studio.engine.animation.clip.together import on_one_clock
from studio.engine.animation.export.glb import GltfDocument
from studio.engine.animation.mannequin import mannequin
from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.base.quaternions import continuous_signs, normalized
from studio.engine.identity.recognised import performer_key
from studio.engine.model.calibration import Performer
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.model.performers.bodies import BODIES
from studio.engine.model.performers.colours import performer_colour
from studio.engine.model.poses import Poses, on_output_joints
from studio.engine.model.soles import rest_lift_m
from studio.review.blind.model import MAX_SECONDS, Pair, Side
from studio.take.folder.solved import solved_performers
from studio.take.folder.take import Take

HZ = 60.0
HEAD_JOINT_OF_HEIGHT = 0.93
"""Height of the head joint, in the middle of the head, as a share of a person's height."""

NAME = "clip"


def bake_pairs(pairs: list[tuple[Pair, Take, Take]], body: str) -> list[tuple[bytes, bytes]]:
    """Return the two GLB files of each pair, given the takes of its sides and one of the mannequin's `BODIES`.

    The character has the proportions of the first take's performer, or else the second's. Several performers are all
    shown, each with the bones of the first side's solve. Errors as `bake_pair` and `bake_scene`.
    """
    baked = []
    for pair, *takes in pairs:
        sides = (pair.a, pair.b)
        first, second = (solved_performers(take, side.solve) for take, side in zip(takes, sides, strict=True))
        if len(first) == len(second) == 1:
            known = [take.calibration().performer for take in takes if take.meta["calibration"] is not None]
            performer = next((one for one in known if one is not None), None)
            both = first[0].poses, second[0].poses
            baked.append(bake_pair(both, sides, performer, pair.start_s, pair.end_s, body=body))
        else:
            casts = {one.number: one.poses for one in first}, {one.number: one.poses for one in second}
            baked.append(bake_scene(casts, sides, pair.start_s, pair.end_s, body=body))
    return baked


def bake_pair(
    poses: tuple[Poses, Poses],
    sides: tuple[Side, Side],
    performer: Performer | None,
    start_s: float,
    end_s: float,
    *,
    body: str = BODIES[0],
) -> tuple[bytes, bytes]:
    """Return the two GLB files of a pair.

    Args:
        poses: of the sides; each begins at its own first frame.
        sides: the keys and their interpolation.
        performer: proportions of the character; None uses those of the first side's solve.
        start_s, end_s: the shown part [s from the first frame]; end_s 0 = until the shorter one ends.
        body: one of the mannequin's `BODIES`.

    Raises:
        FormatError: a solve of another skeleton.
        SettingsError: the part is too short, too long, or missing.
    """
    times = _shown(poses, start_s, end_s)
    skeleton = skeleton_of(poses[0]) if performer is None else Skeleton.of(performer)
    poses = (on_output_joints(poses[0]), on_output_joints(poses[1]))
    first, second = (
        glb(_on_character(one, side, times, skeleton), skeleton, body)
        for one, side in zip(poses, sides, strict=True)
    )
    return _alike(first, second)


def bake_scene(
    casts: tuple[Mapping[int, Poses], Mapping[int, Poses]],
    sides: tuple[Side, Side],
    start_s: float,
    end_s: float,
    *,
    body: str = BODIES[0],
) -> tuple[bytes, bytes]:
    """Return the two GLB files of a pair with several performers, each in their colour.

    Args:
        casts: poses by performer number, for both sides. A side begins with the first frame of any performer; absent
            performers stand still.
        sides, start_s, end_s, body: as `bake_pair`.

    Raises:
        FormatError: a solve of another skeleton.
        SettingsError: the sides differ in performers, or the part is too short, too long, or missing.
    """
    first, second = (_on_one_clock(cast) for cast in casts)
    if [*first] != [*second]:
        raise SettingsError(
            "blind.other_performers",
            "one animation of a pair shows the performers {first}, the other {second}; choose solves with the same",
            first=", ".join(map(performer_key, first)),
            second=", ".join(map(performer_key, second)),
        )
    times = _shown((next(iter(first.values())), next(iter(second.values()))), start_s, end_s)
    skeletons = {number: skeleton_of(poses) for number, poses in first.items()}
    one, other = (
        _scene(
            {
                number: _on_character(on_output_joints(poses), side, times, skeletons[number])
                for number, poses in cast.items()
            },
            skeletons,
            body,
        )
        for cast, side in zip((first, second), sides, strict=True)
    )
    return _alike(one, other)


def _on_one_clock(cast: Mapping[int, Poses]) -> dict[int, Poses]:
    return dict(zip(cast, on_one_clock([*cast.values()]), strict=True))


def _scene(cast: Mapping[int, Poses], skeletons: Mapping[int, Skeleton], body: str) -> bytes:
    document = GltfDocument()
    for number, poses in cast.items():
        motion = _with_offsets(local_motion(poses), skeletons[number])
        linear = [(part / 255.0) ** 2.2 for part in performer_colour(number)]  # glTF's colours are linear
        document.add_performer(
            performer_key(number), motion, mannequin(motion, body), "linear", [*linear, 1.0]
        )
    document.name_animation(NAME)
    return b"".join(document.finished())


def _shown(poses: tuple[Poses, Poses], start_s: float, end_s: float) -> NDArray[np.float64]:
    """Return the times of the shown part [s from the first frame], at 60 Hz.

    Raises:
        SettingsError: it is too short, too long, or missing.
    """
    length_s = min(float(p.time_s[-1] - p.time_s[0]) for p in poses)
    end_s = end_s or min(length_s, start_s + MAX_SECONDS)
    if not 0.5 <= end_s - start_s <= MAX_SECONDS or end_s > length_s + 0.05:
        raise SettingsError(
            "blind.pair_too_long",
            "a pair from {start:g} to {end:g} s is not possible: both animations last "
            "{length:.1f} s, and 0.5 to {most:g} s are shown",
            start=start_s,
            end=end_s,
            length=length_s,
            most=MAX_SECONDS,
        )
    return start_s + np.arange(int(np.floor((min(end_s, length_s) - start_s) * HZ)) + 1) / HZ


def _alike(first: bytes, second: bytes) -> tuple[bytes, bytes]:
    """Check that both files have one size; return them.

    Raises:
        FormatError: the sizes differ.
    """
    if len(first) != len(second):
        raise FormatError(
            "blind.pair_sizes", "the two animations of a pair came out in different sizes; choose others"
        )
    return first, second


def skeleton_of(poses: Poses) -> Skeleton:
    """Return the skeleton of a solve's own bones, from the median of the frames, standing on the floor.

    Raises:
        FormatError: it lacks joints of the output skeleton.
    """
    if poses.joint_names != OUTPUT_JOINTS:
        raise FormatError(
            "blind.pair_no_performer", "neither take of a pair knows a performer; calibrate one of them first"
        )
    offsets = np.empty((len(OUTPUT_JOINTS), 3))
    for joint, parent in enumerate(OUTPUT_PARENTS):
        if parent >= 0:
            back = Rotation.from_quat(poses.rotations_wxyz[:, parent], scalar_first=True).inv()
            offsets[joint] = np.median(
                back.apply(poses.positions_m[:, joint] - poses.positions_m[:, parent]), axis=0
            )
    offsets[0] = 0.0
    hips = rest_lift_m(Skeleton(offsets, 0.0).rest_positions_m[:, 2], poses.root_height_m)
    offsets[0] = (0.0, 0.0, hips)
    trunk = [OUTPUT_INDEX[name] for name in ("Spine", "Spine1", "Spine2", "Neck", "Head")]
    return Skeleton(offsets, height_m=(hips + float(offsets[trunk, 2].sum())) / HEAD_JOINT_OF_HEIGHT)


def _on_character(poses: Poses, side: Side, times: NDArray[np.float64], skeleton: Skeleton) -> Poses:
    """Return a solve on the character at these times [s from its first frame]."""
    hips, rotations = _sampled(poses, side, times)
    scale = float(skeleton.offsets_m[0, 2] / max(_leg_m(poses), 0.1))
    hips = hips * [1.0, 1.0, scale]
    positions = np.empty((len(times), len(OUTPUT_JOINTS), 3))
    positions[:, 0] = hips
    for joint, parent in enumerate(OUTPUT_PARENTS):
        if parent >= 0:
            turn = Rotation.from_quat(rotations[:, parent], scalar_first=True)
            positions[:, joint] = positions[:, parent] + turn.apply(skeleton.offsets_m[joint])
    unknown = np.full(positions.shape[:2], np.nan)
    height_m = float(skeleton.offsets_m[0, 2])
    sure = np.ones_like(unknown)
    return Poses(times, OUTPUT_JOINTS, OUTPUT_PARENTS, positions, rotations, sure, unknown, height_m)


def _leg_m(poses: Poses) -> float:
    """Height of the hips above the floor in a T-pose, from the leg bones and the lowest toes [m]."""
    chain = [OUTPUT_INDEX[name] for name in ("LeftUpLeg", "LeftLeg", "LeftFoot")]
    bones = np.linalg.norm(np.diff(poses.positions_m[:, chain], axis=1), axis=2)
    ankle = np.percentile(poses.positions_m[:, chain[-1], 2], 5)
    drop = np.linalg.norm(poses.positions_m[:, chain[0]] - poses.positions_m[:, 0], axis=1)
    return float(np.median(bones.sum(axis=1)) + np.clip(ankle, 0.0, 0.15) + 0.5 * np.median(drop))


def _sampled(
    poses: Poses, side: Side, times: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the hips' path, shape (N, 3), and world rotations wxyz, shape (N, 52, 4), interpolated between keys."""
    own = poses.time_s - poses.begins_s
    keys = own if side.key_hz == 0 else np.arange(int(np.floor(own[-1] * side.key_hz)) + 1) / side.key_hz
    at = np.clip(times, keys[0], keys[-1])
    if side.interpolation == "held":
        at = keys[np.searchsorted(keys, at + 1e-9, side="right") - 1]
    hips_keys = np.stack([np.interp(keys, own, poses.positions_m[:, 0, k]) for k in range(3)], axis=1)
    rotations = np.empty((len(times), len(OUTPUT_JOINTS), 4))
    for joint in range(len(OUTPUT_JOINTS)):
        track = Slerp(own, Rotation.from_quat(poses.rotations_wxyz[:, joint], scalar_first=True))(keys)
        rotations[:, joint] = _between(keys, track, at, cubic=side.interpolation == "cubic")
    if side.interpolation == "cubic":
        return _cubic(keys, hips_keys, at), rotations
    return np.stack([np.interp(at, keys, hips_keys[:, k]) for k in range(3)], axis=1), rotations


def _between(
    keys: NDArray[np.float64], track: Rotation, at: NDArray[np.float64], *, cubic: bool
) -> NDArray[np.float64]:
    if len(keys) < 2:
        return np.repeat(track.as_quat(scalar_first=True), len(at), axis=0)
    if not cubic:
        return Slerp(keys, track)(at).as_quat(scalar_first=True)
    return normalized(_cubic(keys, continuous_signs(track.as_quat(scalar_first=True)), at))


def _cubic(
    keys: NDArray[np.float64], values: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Values at times from cubics with central-difference slopes, as in exports."""
    if len(keys) < 2:
        return np.repeat(values, len(at), axis=0)
    return CubicHermiteSpline(keys, values, np.gradient(values, keys, axis=0))(at)


def glb(poses: Poses, skeleton: Skeleton, body: str = BODIES[0]) -> bytes:
    """Return poses of the character as a GLB file: linear keys at 60 Hz, with one of the mannequin's bodies."""
    motion = _with_offsets(local_motion(poses), skeleton)
    document = GltfDocument()
    document.add_skeleton(motion)
    document.add_mesh(mannequin(motion, body))
    document.add_animation(motion, "linear")
    return b"".join(document.finished())


def _with_offsets(motion: LocalMotion, skeleton: Skeleton) -> LocalMotion:
    """Return a motion with exactly the character's rest offsets, without rounding differences."""
    offsets = to_file_axes(skeleton.offsets_m)
    offsets[0] = (0.0, skeleton.offsets_m[0, 2], 0.0)
    return replace(motion, name=NAME, offsets_m=offsets, positions_m={0: motion.positions_m[0]})
