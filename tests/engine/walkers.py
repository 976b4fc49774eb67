"""Synthetic performers with known proportions, and ideal or noisy cameras at known places that see them."""

from collections.abc import Callable, Iterator
from functools import cache, lru_cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.proportions import AUTHORED_OFFSETS
from studio.engine.base.geometry import invert_transform, make_transform, transform_points
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import CameraFrame, FrameSet, FusedSkeleton, HandSeen
from studio.engine.model.human.humanoid import Humanoid, build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX, JOINT_COUNT

SECOND = 1_000_000_000
AUTHORED_HEIGHT_M = 1.78

JointsAt = Callable[[float], NDArray[np.float64]]
"""Time [s] -> canonical joints on the stage [m], shape (21, 3)."""


def performer(height_m: float = AUTHORED_HEIGHT_M) -> Performer:
    """A performer of the authored proportions, scaled to a height."""
    return Performer(height_m, AUTHORED_OFFSETS * (height_m / AUTHORED_HEIGHT_M))


@cache
def humanoid(height_m: float = AUTHORED_HEIGHT_M, *, human_limits: bool = True) -> Humanoid:
    """The humanoid of `performer(height_m)`; it is shared and must not be changed."""
    return build_humanoid(Skeleton.of(performer(height_m)), human_limits=human_limits)


def site_positions(body: Humanoid, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Canonical joints [m], shape (21, 3), of a configuration, by MuJoCo's own kinematics."""
    data = _data(body.model)
    data.qpos[:] = q
    mujoco.mj_kinematics(body.model, data)
    return data.site_xpos[body.site_ids].copy()


@lru_cache(maxsize=8)
def _data(model: mujoco.MjModel) -> mujoco.MjData:
    return mujoco.MjData(model)


def random_q(body: Humanoid, rng: np.random.Generator, *, reach: float = 1.0) -> NDArray[np.float64]:
    """A random configuration within the ranges: each hinge anywhere in the middle `reach` of its range."""
    q = body.rest_qpos
    low, high = body.range_rad.T
    middle, half = (low + high) / 2, (high - low) / 2
    q[7:] = middle + reach * half * rng.uniform(-1, 1, len(half))
    q[:2] = rng.uniform(-0.5, 0.5, 2)
    yaw = rng.uniform(-np.pi, np.pi)
    q[3:7] = [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
    return q


def usual_q(body: Humanoid, rng: np.random.Generator, *, spreads: float = 1.0) -> NDArray[np.float64]:
    """A usual human configuration: hinges deviate from the resting stance by their spread."""
    q = random_q(body, rng)
    stray = body.rest_q + spreads * body.spread_rad * np.clip(rng.normal(size=len(body.rest_q)), -2, 2)
    q[7:] = np.clip(stray, *body.range_rad.T)
    return q


def standing(time_s: float = 0.0) -> NDArray[np.float64]:
    """The authored performer in the resting stance, shape (21, 3), whatever the time."""
    return site_positions(humanoid(), humanoid().rest_qpos)


def arms_swinging(time_s: float) -> NDArray[np.float64]:
    """The authored performer in place with arms and trunk moving gently, shape (21, 3)."""
    body = humanoid()
    q = body.rest_qpos
    wave = np.sin(2 * np.pi * 0.5 * time_s + np.arange(len(body.rest_q)))
    q[7:] = np.clip(body.rest_q + np.where(_of_legs(), 0.0, 0.4 * body.spread_rad) * wave, *body.range_rad.T)
    return site_positions(body, q)


@cache
def _of_legs() -> NDArray[np.bool_]:
    """Which hinges of the authored performer belong to the legs."""
    body = humanoid()
    return np.array([any(p in body.model.joint(i + 1).name for p in ("Leg", "Foot", "Toe"))
                     for i in range(len(body.rest_q))])  # fmt: skip


def camera_at(angle_deg: float, *, distance_m: float = 3.5, height_m: float = 1.2) -> NDArray[np.float64]:
    """`T_stage_camera` of an upright camera that looks at the stage's middle; 0 = in front of the performer."""
    turn = np.radians(angle_deg)
    ahead = np.array([-np.sin(turn), np.cos(turn), 0.0])
    down = np.array([0.0, 0.0, -1.0])
    place = np.array([distance_m * np.sin(turn), -distance_m * np.cos(turn), height_m])
    return make_transform(np.column_stack([np.cross(down, ahead), down, ahead]), place)


def stage(*angles_deg: float, height_m: float = AUTHORED_HEIGHT_M, bias_m: float = 0.0) -> Calibration:
    """The true calibration of cameras `a`, `b`, ... at these angles, with the performer."""
    cameras = {
        name: CameraCalibration(camera_at(angle), depth_bias_m=bias_m)
        for name, angle in zip("abcdefgh"[: len(angles_deg)], angles_deg, strict=True)
    }
    return Calibration("a", cameras, performer(height_m))


def camera_frame(
    calibration: Calibration,
    camera: str,
    time_s: float,
    joints: NDArray[np.float64],
    *,
    confidence: float = 0.95,
    hands: tuple[HandSeen, ...] = (),
) -> CameraFrame:
    """A camera's view of joints on the stage, shape (21, 3) [m], without error; NaN stays unseen."""
    seen = transform_points(invert_transform(calibration.cameras[camera].T_stage_camera), joints)
    sure = np.where(np.isnan(seen[:, 0]), 0.0, confidence)
    return CameraFrame(camera, round(time_s * 30), round(time_s * SECOND), seen, sure, hands)


def recorded(
    calibration: Calibration,
    joints_at: JointsAt,
    seconds: float,
    *,
    noise_m: float = 0.0,
    seed: int = 0,
    start_s: float = 1.0,
    hz: float = 30.0,
) -> Iterator[CameraFrame]:
    """Frames of all cameras in turn; noise is AR(1) with 0.8 per frame and SD `noise_m` per axis."""
    rng = np.random.default_rng(seed)
    state = {name: rng.normal(size=(JOINT_COUNT, 3)) for name in calibration.cameras}
    for k in range(round(seconds * hz)):
        time_s = start_s + k / hz
        joints = joints_at(time_s)
        for name in calibration.cameras:
            state[name] = 0.8 * state[name] + 0.6 * rng.normal(size=(JOINT_COUNT, 3))
            yield camera_frame(calibration, name, time_s, joints + noise_m * state[name])


def frame_set(
    time_s: float,
    positions: NDArray[np.float64],
    *,
    confidence: NDArray[np.float64] | float = 0.95,
    angles_deg: tuple[float, ...] = (-35.0, 35.0, 90.0, 180.0),
) -> FrameSet:
    """A frame set of cameras that see joints on the stage, positions of shape (camera_count, 21, 3) [m]."""
    count = len(positions)
    sure = np.where(np.isnan(positions[:, :, 0]), 0.0, confidence)
    places = np.array([camera_at(angle)[:3, 3] for angle in angles_deg[:count]])
    return FrameSet(round(time_s * SECOND), tuple("abcd"[:count]), positions, sure, places)


def fused(joints: NDArray[np.float64], *, sigma_m: float = 0.01) -> FusedSkeleton:
    """A fused skeleton of these joints, shape (21, 3) [m]; NaN = unseen."""
    seen = np.isfinite(joints[:, 0])
    return FusedSkeleton(joints, seen * 1.0, np.where(seen, sigma_m, np.nan), seen[None])


def only(joints: NDArray[np.float64], *names: str) -> NDArray[np.float64]:
    """The joints with all but the named ones unseen."""
    out = np.full_like(joints, np.nan)
    keep = [INDEX[name] for name in names]
    out[keep] = joints[keep]
    return out
