"""Trimming, smoothing, loops and foot lock."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.leg_ik import reach
from studio.engine.animation.export import ExportOptions, prepared_poses
from studio.engine.base.errors import SettingsError
from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.poses import Poses
from tests.poses_factory import make_poses, random_poses, rest_offsets_m, t_pose
from tests.refused import refused

FEET = [OUTPUT_INDEX[name] for name in ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")]


def _lengths(poses: Poses) -> np.ndarray:
    parents = poses.parents[1:]
    return np.linalg.norm(poses.positions_m[:, 1:] - poses.positions_m[:, parents], axis=-1)


def test_nothing_is_done_unless_asked() -> None:
    poses = random_poses(np.random.default_rng(1), seconds=1)
    assert prepared_poses(poses, ExportOptions()) is poses


def test_trimming() -> None:
    poses = random_poses(np.random.default_rng(1), seconds=2)
    late = replace(poses, time_s=poses.time_s + 40.0)
    part = prepared_poses(late, ExportOptions(start_s=0.5, end_s=1.5))
    assert part.time_s[[0, -1]] == pytest.approx([40.5, 41.5])
    assert part.positions_m == pytest.approx(poses.positions_m[30:91])


def test_smoothing_takes_out_noise_and_is_not_late() -> None:
    slow = random_poses(np.random.default_rng(1), seconds=4, cutoff_hz=1.0)
    rng = np.random.default_rng(2)
    shake = Rotation.from_rotvec(rng.normal(scale=0.02, size=(slow.frame_count * 52, 3)))
    noisy_turns = (Rotation.from_quat(slow.rotations_wxyz.reshape(-1, 4), scalar_first=True) * shake).as_quat(
        scalar_first=True
    )
    local_noise = make_poses(_local(slow, noisy_turns.reshape(-1, 52, 4)), root_m=slow.positions_m[:, 0])
    smooth = prepared_poses(local_noise, ExportOptions(smooth_hz=4.0))
    inner = slice(30, -30)

    def error(poses: Poses, shift: int = 0) -> float:
        moved = np.roll(poses.positions_m, shift, axis=0)
        return float(np.linalg.norm(moved - slow.positions_m, axis=-1)[inner].mean())

    assert error(smooth) < 0.6 * error(local_noise)
    assert error(smooth) < min(error(smooth, 1), error(smooth, -1))
    assert _lengths(smooth) == pytest.approx(_lengths(slow), abs=1e-9)


def _local(poses: Poses, world: np.ndarray) -> np.ndarray:
    local = world.copy()
    for joint, parent in enumerate(poses.parents):
        if parent >= 0:
            above = Rotation.from_quat(world[:, parent], scalar_first=True)
            local[:, joint] = (above.inv() * Rotation.from_quat(world[:, joint], scalar_first=True)).as_quat(
                scalar_first=True
            )
    return local


def _walk(seconds: float, *, speed_m_s: float) -> Poses:
    """Legs that swing at 1 Hz while the hips move forward."""
    time_s = np.arange(round(seconds * 60) + 1) / 60
    vectors = np.zeros((len(time_s), 52, 3))
    for side, phase in (("Left", 0.0), ("Right", np.pi)):
        vectors[:, OUTPUT_INDEX[f"{side}UpLeg"], 0] = 0.5 * np.sin(2 * np.pi * time_s + phase)
        vectors[:, OUTPUT_INDEX[f"{side}Arm"], 1] = 0.3 * np.sin(2 * np.pi * time_s + phase) + 0.005 * time_s
    root = rest_offsets_m()[0] + np.outer(time_s, [0.0, -speed_m_s, 0.0])
    local = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat(scalar_first=True).reshape(-1, 52, 4)
    return make_poses(local, root_m=root)


@pytest.mark.parametrize("fps", [60.0, 25.0])
def test_a_loop_ends_where_it_began(fps: float) -> None:
    loop = prepared_poses(_walk(4.3, speed_m_s=0.0), ExportOptions(loop=True, fps=fps))
    assert loop.positions_m[-1] == pytest.approx(loop.positions_m[0], abs=1e-9)
    seconds = loop.time_s[-1] - loop.time_s[0]
    assert seconds == pytest.approx(round(seconds), abs=1.01 / fps) and seconds > 2.1  # whole strides
    closed = np.concatenate([loop.positions_m[-2:-1], loop.positions_m])
    bends = np.abs(np.diff(closed, 2, axis=0)).max(axis=(1, 2))
    assert bends[0] < 1.2 * bends[1:].max()  # the seam has no kink that the motion lacks
    assert _lengths(loop) == pytest.approx(np.tile(_lengths(loop)[:1], (loop.frame_count, 1)), abs=1e-9)


def test_a_walk_that_travels_keeps_its_path() -> None:
    loop = prepared_poses(_walk(4.3, speed_m_s=1.2), ExportOptions(loop=True))
    moved = loop.positions_m[-1] - loop.positions_m[0]
    seconds = loop.time_s[-1] - loop.time_s[0]
    assert moved == pytest.approx(np.tile([0.0, -1.2 * seconds, 0.0], (52, 1)), abs=1e-9)


def test_a_clip_too_short_for_a_loop_is_refused() -> None:
    with refused(SettingsError, "export.loop_short", n=11):
        prepared_poses(_walk(10 / 60, speed_m_s=0.0), ExportOptions(loop=True))


def test_cutoff_above_the_frames_is_refused() -> None:
    with refused(SettingsError, "export.smooth_hz", rate=60):
        prepared_poses(t_pose(60), ExportOptions(smooth_hz=30.0))


def _sliding() -> Poses:
    """A performer who stands with bent knees, the feet sliding by 3 cm to and fro; then a step of the left leg."""
    time_s = np.arange(241) / 60
    vectors = np.zeros((241, 52, 3))
    lift = np.clip(np.sin(np.pi * np.clip(time_s - 2.5, 0, 1)), 0, None)
    for side in ("Left", "Right"):
        bend = 0.4 + (0.6 * lift if side == "Left" else 0.0)
        vectors[:, OUTPUT_INDEX[f"{side}UpLeg"], 0] = -bend
        vectors[:, OUTPUT_INDEX[f"{side}Leg"], 0] = 2 * bend
        vectors[:, OUTPUT_INDEX[f"{side}Foot"], 0] = -bend
    root = np.tile(rest_offsets_m()[0], (241, 1))
    root[:, 0] += 0.015 * np.sin(1.3 * time_s)
    root[:, 1] += 0.015 * np.sin(0.9 * time_s + 1)
    local = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat(scalar_first=True).reshape(-1, 52, 4)
    poses = make_poses(local, root_m=root)
    return replace(poses, positions_m=poses.positions_m - [0, 0, poses.positions_m[:, FEET, 2].min() - 0.02])


def test_foot_lock_holds_standing_feet_and_nothing_else_jumps() -> None:
    poses = _sliding()
    locked = prepared_poses(poses, ExportOptions(foot_lock=True))
    slide = {
        name: np.abs(np.diff(p.positions_m[10:130, FEET, :2], axis=0)).max() * 60 * 100
        for name, p in (("before", poses), ("after", locked))
    }
    assert slide["before"] > 1.5 and slide["after"] < 0.05  # cm/s
    assert _lengths(locked) == pytest.approx(_lengths(poses), abs=1e-9)
    steps = np.linalg.norm(np.diff(locked.positions_m, 2, axis=0), axis=-1) * 3600
    assert steps.max() < np.linalg.norm(np.diff(poses.positions_m, 2, axis=0), axis=-1).max() * 3600 + 6.0
    trunk = OUTPUT_INDEX["Head"]
    assert locked.positions_m[:, trunk] == pytest.approx(poses.positions_m[:, trunk], abs=1e-12)
    swing = (poses.time_s > 2.75) & (poses.time_s < 3.2)
    lifted = OUTPUT_INDEX["LeftFoot"]
    assert np.abs(locked.positions_m[swing, lifted] - poses.positions_m[swing, lifted]).max() < 0.01


def test_foot_lock_needs_legs() -> None:
    poses = t_pose(10)
    other = replace(poses, joint_names=tuple(name.replace("Leg", "Limb") for name in poses.joint_names))
    with refused(SettingsError, "export.foot_lock_lacks"):
        prepared_poses(other, ExportOptions(foot_lock=True))


def test_a_leg_reaches_its_target_and_bends_forward() -> None:
    rng = np.random.default_rng(5)
    hip, side = np.zeros((200, 3)), np.tile([1.0, 0.0, 0.0], (200, 1))
    knee, ankle = np.tile([0.0, -0.05, -0.42], (200, 1)), np.tile([0.0, 0.0, -0.83], (200, 1))
    target = ankle + rng.uniform(-0.2, 0.2, (200, 3)) + [0, 0, 0.35]
    thigh, shin = reach(hip, knee, ankle, target, side)
    at_knee = thigh.apply(knee)
    assert at_knee + shin.apply(ankle - knee) == pytest.approx(target, abs=1e-9)
    assert np.linalg.norm(at_knee, axis=1) == pytest.approx(np.linalg.norm(knee, axis=1))
    straight = np.tile([0.0, 0.0, -0.42], (200, 1)), np.tile([0.0, 0.0, -0.84], (200, 1))
    thigh, _ = reach(hip, *straight, np.tile([0.0, 0.0, -0.6], (200, 1)), side)
    assert (thigh.apply(straight[0])[:, 1] < -0.1).all()  # forward is -y


def test_a_target_out_of_reach_stretches_the_leg_but_not_straight() -> None:
    hip, side = np.zeros((1, 3)), np.array([[1.0, 0, 0]])
    knee, ankle = np.array([[0.0, -0.1, -0.4]]), np.array([[0.0, 0.0, -0.8]])
    thigh, shin = reach(hip, knee, ankle, np.array([[0.0, 0.0, -2.0]]), side)
    end = thigh.apply(knee) + shin.apply(ankle - knee)
    assert 0.81 < -end[0, 2] < 0.821 and np.abs(end[0, :2]).max() < 1e-9  # of 0.8246
