"""A take without a solve, loaded for replay: its cameras' skeletons, and its content."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import StudioError, TakeError
from studio.engine.base.geometry import make_transform, transform_points
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import ClockModel, FrameSet, FusedSkeleton, StepResult
from studio.engine.model.joints import JOINT_COUNT, OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.engine.model.poses import Poses
from studio.engine.model.triangulation.guess import camera_joints
from studio.engine.whole_take.trace import TraceCollector
from studio.take.folder.take import Take
from studio.take.raw.depth import DepthRecording
from studio.take.raw.frames import camera_frames, inspect_raw
from studio.web.playback.clip import Clip
from studio.web.points.replayed import ReplayedDepth

RATE_HZ = 30.0
_NEAR_S = 0.1
"""Maximum distance between an instant and the camera frame that stands for it [s]."""

_APART_M = 2.0
"""Distance between the skeletons of cameras that no calibration places [m]."""

_LOOKING_NORTH = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
_UNSEEN = np.full(JOINT_COUNT, np.nan)


@dataclass(frozen=True)
class RawClip(Clip):
    """The skeletons that the cameras of a take saw: its solve has no name, and there is no body.

    `holds` has `skeletons` and `depth`, the numbers of frames and images by camera, and `calibrated`.
    """

    def step(self, frame: int) -> StepResult:
        """Return the cameras' skeletons at a frame; `positions_m` is NaN."""
        result = super().step(frame)
        return replace(result, positions_m=np.full_like(result.positions_m, np.nan))


def load_raw(take: Take) -> RawClip:
    """Return the skeletons that the cameras saw, at 30 Hz: on the stage if the take is calibrated, else side by side.

    Raises:
        TakeError: the take has no frames.
    """
    frames = {name: list(mine) for name, mine in camera_frames(take.raw_path).items() if len(mine)}
    depth = _depth_times(take)
    calibration = _calibration(take)
    placed = {
        name: (calibration.cameras[name].T_stage_camera, calibration.cameras[name].clock)
        for name in {**frames, **depth}
        if calibration is not None and name in calibration.cameras
    }
    times = {name: np.array([frame.device_time_ns for frame in mine]) for name, mine in frames.items()}
    joints = {name: np.stack([camera_joints(frame) for frame in mine]) for name, mine in frames.items()}
    if not placed:
        placed = _side_by_side({**depth, **times}, joints)
    names = tuple(name for name in {**frames, **depth} if name in placed)
    stage_s = {name: placed[name][1].stage_s({**depth, **times}[name] * 1e-9) for name in names}
    if not names:
        raise TakeError(
            "take.no_calibrated_camera",
            "{take} has no frames of a camera that its calibration knows; nothing can be shown",
            take=take.path,
        )
    begin_s, end_s = min(one[0] for one in stage_s.values()), max(one[-1] for one in stage_s.values())
    grid_s = begin_s + np.arange(int((end_s - begin_s) * RATE_HZ) + 1) / RATE_HZ
    seen = np.full((len(grid_s), len(names), JOINT_COUNT, 3), np.nan)
    for k, name in enumerate(names):
        if name in joints:
            on_stage = transform_points(placed[name][0], joints[name])
            nearest, near = _nearest(stage_s[name], grid_s)
            seen[near, k] = on_stage[nearest[near]]
    trace = TraceCollector()
    used = np.ones((len(names), JOINT_COUNT), dtype=bool)
    fused = FusedSkeleton(np.full((JOINT_COUNT, 3), np.nan), np.zeros(JOINT_COUNT), _UNSEEN, used)
    poses = _placeholder(grid_s, seen)
    for row, time_s in enumerate(grid_s):
        frame_set = FrameSet(
            round(float(time_s) * 1e9), names, seen[row], np.ones((len(names), JOINT_COUNT)), np.zeros((0, 3))
        )
        trace.add(
            StepResult(
                frame_set, fused, poses.positions_m[row], poses.rotations_wxyz[row], poses.confidence[row],
                poses.uncertainty_mm[row],
            )
        )  # fmt: skip
    holds = {
        "skeletons": {name: len(mine) for name, mine in frames.items()},
        "depth": {name: len(mine) for name, mine in depth.items()},
        "calibrated": calibration is not None,
    }
    take_id = f"{take.path.parent.name}/{take.path.name}"
    return RawClip(
        take_id,
        "",
        poses,
        trace.trace(),
        calibration,
        holds=holds,
        depth=ReplayedDepth(take.raw_path, placed),
    )


def _calibration(take: Take) -> Calibration | None:
    try:
        return take.calibration()
    except StudioError:
        return None


def _depth_times(take: Take) -> dict[str, NDArray[np.int64]]:
    """Return the device times of the depth images by camera [ns]."""
    if not inspect_raw(take.raw_path).depth_frames:
        return {}
    recording = DepthRecording(take.raw_path)
    return {name: recording.times_ns(name) for name in recording.cameras}


def _side_by_side(
    times_ns: dict[str, NDArray[np.int64]], joints: dict[str, NDArray[np.float64]]
) -> dict[str, tuple[NDArray[np.float64], ClockModel]]:
    """Place cameras as if they looked level: each one's performer stands on the floor next to the others', and all
    begin together."""
    placed = {}
    for k, (name, times) in enumerate(times_ns.items()):
        T_stage_camera = make_transform(_LOOKING_NORTH, np.array([0.0, 0.0, 1.0]))
        if name in joints and np.isfinite(joints[name]).any():
            there = joints[name] @ _LOOKING_NORTH.T
            centre = np.nanmedian(there, axis=(0, 1))
            T_stage_camera[:3, 3] = [-centre[0], -centre[1], -np.nanpercentile(there[..., 2], 1.0)]
        T_stage_camera[0, 3] += _APART_M * (k - (len(times_ns) - 1) / 2.0)
        placed[name] = (T_stage_camera, ClockModel(offset_ns=-int(times[0])))
    return placed


def _nearest(
    times_s: NDArray[np.float64], grid_s: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the index of the frame nearest to each instant, and whether it is near enough."""
    after = np.clip(np.searchsorted(times_s, grid_s), 1, max(len(times_s) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(times_s) - 1)
    nearest = np.where(grid_s - times_s[before] < times_s[after] - grid_s, before, after)
    return nearest, np.abs(times_s[nearest] - grid_s) <= _NEAR_S


def _placeholder(grid_s: NDArray[np.float64], seen: NDArray[np.float64]) -> Poses:
    """Return placeholder poses that hold the times: all joints lie in the middle of what the cameras see."""
    count, joints = len(grid_s), len(OUTPUT_JOINTS)
    known = seen[np.isfinite(seen).all(axis=-1)]
    middle = np.median(known, axis=0) if len(known) else np.array([0.0, 0.0, 1.0])
    return Poses(
        time_s=grid_s,
        joint_names=OUTPUT_JOINTS,
        parents=np.asarray(OUTPUT_PARENTS),
        positions_m=np.tile(middle, (count, joints, 1)),
        rotations_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (count, joints, 1)),
        confidence=np.zeros((count, joints)),
        uncertainty_mm=np.full((count, joints), np.nan),
    )
