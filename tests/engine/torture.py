"""Torture motions through the pipeline, and the faults to exclude: lost limbs, flipped joints."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.animation.motion.torture import TORTURE_OFFSETS
from studio.engine.base.geometry import invert_transform, matrices, transform_points
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import CameraFrame
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.humanoid import Humanoid, build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import (
    INDEX,
    JOINT_COUNT,
    MEASURED_JOINTS,
    OUTPUT_INDEX,
    OUTPUT_OF_CANONICAL_INDEX,
)
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND, NoisyJoints, anatomical_offsets
from studio.simulator.rig import standard_rig

SECOND = 1_000_000_000
OUTPUT_HZ = 60
SETTLED_S = 0.5
LOST_M, LOST_S = 0.20, 0.3
_MEASURED = [INDEX[name] for name in MEASURED_JOINTS]
_BENDS = {"LeftArm": 2, "RightArm": 2, "LeftLeg": 0, "RightLeg": 0}  # column of the elbow's or knee's axis
_BIAS_M = 0.03
PERFORMER = Performer(1.68, TORTURE_OFFSETS)


def known_calibration(cameras: int = 2, *, bias_m: float = _BIAS_M) -> Calibration:
    """The true calibration of the standard rig, with the performer of the torture motions."""
    placed = {c.name: CameraCalibration(c.T_stage_camera, depth_bias_m=bias_m) for c in standard_rig(cameras)}
    return Calibration("camera_0", placed, PERFORMER)


def seen(
    motion: CanonicalMotion, calibration: Calibration, seed: int | None
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Positions and confidence per camera at 30 Hz, shapes (F, 21, 3) and (F, 21); seed None = no error."""
    count = int(motion.duration_s * FRAMES_PER_SECOND) + 1
    joints = np.array([motion.at(k / FRAMES_PER_SECOND) for k in range(count)])
    places = [camera.T_stage_camera for camera in calibration.cameras.values()]
    if seed is None:
        return [
            (transform_points(invert_transform(T), joints), np.full((count, JOINT_COUNT), 0.95))
            for T in places
        ]
    performer, *streams = np.random.SeedSequence(seed).spawn(1 + len(places))
    anatomy = anatomical_offsets(np.random.default_rng(performer))
    return [
        NoisyJoints(T, motion.offsets_m, anatomy, np.random.default_rng(stream)).see_all(joints)
        for T, stream in zip(places, streams, strict=True)
    ]


def frames_of(motion: CanonicalMotion, calibration: Calibration, seed: int | None) -> list[CameraFrame]:
    """All cameras' frames in order of time; seed None = no error."""
    views = seen(motion, calibration, seed)
    return [
        CameraFrame(name, k, round(k * SECOND / FRAMES_PER_SECOND), positions[k], confidence[k])
        for k in range(len(views[0][0]))
        for (positions, confidence), name in zip(views, calibration.cameras, strict=True)
    ]


def solved(
    motion: CanonicalMotion, *assignments: str, seed: int | None, preset: str = "studio", cameras: int = 2
) -> Poses:
    """The poses at 60 Hz, with the known calibration."""
    calibration = known_calibration(cameras, bias_m=0.0 if seed is None else _BIAS_M)
    frames = frames_of(motion, calibration, seed)
    return solve_frames(frames, calibration, parse_settings(preset, assignments))


@dataclass(frozen=True)
class Figures:
    """Figures of one motion.

    Attributes:
        mean_mm: mean error of the measured joints.
        lost_s: longest time that a joint was further off than `LOST_M`; `lost_joint` is which.
        axis_turn_deg: largest turn of an elbow's or knee's axis from frame to frame; `axis_joint` is which.
        turn_rad_s: fastest turn of an output rotation; `turn_joint` is which, `turn_s` when.
        excess_deg: largest excess of a hinge beyond its range.
        finite: whether all numbers are finite.
    """

    mean_mm: float
    lost_s: float
    lost_joint: str
    axis_turn_deg: float
    axis_joint: str
    turn_rad_s: float
    turn_joint: str
    turn_s: float
    excess_deg: float
    finite: bool


def figures(motion: CanonicalMotion, poses: Poses) -> Figures:
    """Return the figures of a motion's poses, from `SETTLED_S` on."""
    settled = poses.time_s >= SETTLED_S
    times, positions = poses.time_s[settled], poses.positions_m[settled]
    truth = np.array([motion.at(t) for t in times])[:, _MEASURED]
    error = np.linalg.norm(positions[:, OUTPUT_OF_CANONICAL_INDEX][:, _MEASURED] - truth, axis=2)
    rotations = matrices(poses.rotations_wxyz[settled])
    lost = [_longest_s(error[:, j] > LOST_M) for j in range(len(_MEASURED))]
    turns = _turn_rad(rotations) * OUTPUT_HZ
    axes = {
        name: np.degrees(_angle(rotations[:, OUTPUT_INDEX[name], :, column])).max()
        for name, column in _BENDS.items()
    }
    frame, joint = np.unravel_index(turns.argmax(), turns.shape)
    axis_joint = max(axes, key=lambda name: axes[name])
    return Figures(
        mean_mm=1e3 * float(error.mean()),
        lost_s=max(lost),
        lost_joint=MEASURED_JOINTS[int(np.argmax(lost))],
        axis_turn_deg=float(axes[axis_joint]),
        axis_joint=axis_joint,
        turn_rad_s=float(turns.max()),
        turn_joint=list(OUTPUT_INDEX)[joint],
        turn_s=float(times[frame]),
        excess_deg=_excess_deg(positions[::4], rotations[::4]),
        finite=bool(np.isfinite(rotations).all() and np.isfinite(error).all()),
    )


def _longest_s(bad: NDArray[np.bool_]) -> float:
    """The longest run of True [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], bad.astype(int), [0]])))
    return float((edges[1::2] - edges[::2]).max()) / OUTPUT_HZ if len(edges) else 0.0


def _angle(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle between one frame's unit direction and the next's, shape (F - 1,)."""
    return np.arccos(np.clip((directions[1:] * directions[:-1]).sum(axis=1), -1.0, 1.0))


def _turn_rad(rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn from each frame to the next, shape (F - 1, 52), of rotations (F, 52, 3, 3)."""
    trace = np.einsum("fjab,fjab->fj", rotations[1:], rotations[:-1])
    return np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0))


def _excess_deg(positions: NDArray[np.float64], rotations: NDArray[np.float64]) -> float:
    body: Humanoid = build_humanoid(Skeleton.of(PERFORMER))
    low, high = body.range_rad.T
    worst = 0.0
    for joints, turned in zip(positions, rotations, strict=True):
        q = configuration_of(body, joints[0], turned, limited=False)[7:]
        worst = max(worst, float(np.maximum(low - q, q - high).max()))
    return float(np.degrees(worst))
