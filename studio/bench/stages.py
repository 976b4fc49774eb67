"""The stages that are measured, each fed with what the stage before it gave."""

import tempfile
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.bench.plain_mink import PlainMink, RetargetingMink
from studio.bench.stage import Stage
from studio.bench.timing import WARM_UP, per_frame
from studio.camera.simulator.noisy_joints import FRAMES_PER_SECOND
from studio.engine.body import Body
from studio.engine.completion.floor import FloorContact
from studio.engine.completion.hands import Hands
from studio.engine.completion.look_at import LookAt
from studio.engine.conditioning.filters import FILTERS
from studio.engine.errors import NotAvailableError
from studio.engine.export import EXPORTERS, export
from studio.engine.frames import CameraFrame, FrameSet, FusedSkeleton, StepResult
from studio.engine.fusion import make_fusion
from studio.engine.geometry import matrices
from studio.engine.human.model import build_humanoid
from studio.engine.human.skeleton import Skeleton
from studio.engine.pipeline import Pipeline
from studio.engine.poses import Poses
from studio.engine.schedule import Schedule
from studio.engine.settings import SolveSettings, preset
from studio.engine.solve.solver import Solver
from studio.engine.solve.take import solve_frames
from studio.engine.sync import Synchroniser
from studio.streams.frames import frame_message
from studio.streams.unity import unity_pose
from studio.streams.vmc import VmcEncoder
from studio.take.raw import RawWriter, camera_frame

Figures = dict[str, float | None]

SETTINGS: SolveSettings = preset("studio")
OUTPUT_S = 1.0 / SETTINGS.output_hz


def parse(stage: Stage) -> tuple[Figures, list[CameraFrame]]:
    """One message of one camera: from bytes to canonical joints."""
    frames: list[CameraFrame] = []

    def work(item: tuple[str, bytes]) -> None:
        message = wire.decode(item[1])
        assert isinstance(message, wire.SkeletonFrame)
        frames.append(camera_frame(item[0], stage.joint_set, message))

    return per_frame(work, stage.messages), frames


def record(stage: Stage) -> Figures:
    """One message of one camera into `raw.mcap`, with a flush every half second."""
    hello = [
        wire.Hello(wire.PROTOCOL_VERSION, name, "bench", stage.joint_set, "bench")
        for name in stage.calibration.cameras
    ]
    with tempfile.TemporaryDirectory() as folder, RawWriter(Path(folder) / "raw.mcap") as writer:
        for camera in hello:
            writer.add_camera(camera)

        def work(item: tuple[int, tuple[str, bytes]]) -> None:
            number, (camera, data) = item
            time_ns = round(number / len(hello) / FRAMES_PER_SECOND * 1e9)
            writer.frame(camera, data, arrival_ns=time_ns, device_time_ns=time_ns, sequence=number)
            if number % (FRAMES_PER_SECOND * len(hello) // 2) == 0:
                writer.flush()

        return per_frame(work, list(enumerate(stage.messages)))


def sync(stage: Stage, frames: list[CameraFrame]) -> tuple[Figures, list[FrameSet]]:
    """One output frame: the frames that came since the last one taken in, and all cameras at one instant."""
    synchroniser = Synchroniser(stage.calibration.cameras, ahead_ns=SETTINGS.ahead_ns)
    schedule = Schedule.of(SETTINGS)
    sets: list[FrameSet] = []
    batches: list[tuple[list[CameraFrame], int]] = []
    waiting: list[CameraFrame] = []
    newest: dict[str, int] = {}
    for frame in frames:
        waiting.append(frame)
        newest[frame.camera] = frame.device_time_ns
        for due in schedule.due(newest):
            batches.append((waiting, due))
            waiting = []

    def work(batch: tuple[list[CameraFrame], int]) -> None:
        for frame in batch[0]:
            synchroniser.add(frame)
        sets.append(synchroniser.frame_set(batch[1]))

    return per_frame(work, batches), sets


def fusion(sets: list[FrameSet]) -> tuple[Figures, list[FusedSkeleton]]:
    """One output frame: all cameras' skeletons to one, for a solve that is not told the cameras' own joints."""
    fuse, fused = make_fusion(SETTINGS), []
    figures = per_frame(lambda frame_set: fused.append(fuse.fuse(frame_set)), sets)
    return figures, fused


def solve(stage: Stage, sets: list[FrameSet]) -> Figures:
    """One output frame from the cameras' joints to the pose, fusion and completion included, as preset `studio` does
    it."""
    body = Body(stage.calibration.performer, SETTINGS)
    return per_frame(lambda frame_set: body.pose_of_cameras(frame_set, OUTPUT_S), sets)


def solve_mink(stage: Stage, fused: list[FusedSkeleton]) -> Figures:
    """One output frame of `ik=previous_pose`, two iterations of mink, body only."""
    humanoid = build_humanoid(Skeleton.of(stage.calibration.performer))
    solver = Solver(humanoid, replace(SETTINGS, ik="previous_pose"))
    return per_frame(lambda skeleton: solver.solve(skeleton.positions, skeleton.sigma, OUTPUT_S), fused)


def mink_frame_tasks(stage: Stage, fused: list[FusedSkeleton]) -> Figures:
    """The same by plain mink, for comparison."""
    solver = PlainMink(build_humanoid(Skeleton.of(stage.calibration.performer)))
    return per_frame(lambda skeleton: solver.solve(skeleton.positions), fused)


def retargeting_mink(stage: Stage, fused: list[FusedSkeleton]) -> Figures:
    """The same by mink with the settings of General Motion Retargeting, for comparison."""
    solver = RetargetingMink(build_humanoid(Skeleton.of(stage.calibration.performer)))
    return per_frame(lambda skeleton: solver.solve(skeleton.positions), fused)


def filters(fused: list[FusedSkeleton]) -> dict[str, Figures]:
    """One output frame of each filter on the fused joints."""
    out = {}
    for name, make in FILTERS.items():
        one = make()
        out[f"filter_{name}"] = per_frame(lambda s, one=one: one.apply(s.positions, OUTPUT_S), fused)
    return out


def sending(results: list[StepResult]) -> dict[str, Figures]:
    """One output frame as bytes: for programs by WebSocket (`encode`), for receivers by VMC (`broadcast`)."""
    vmc = VmcEncoder()
    return {
        "encode": per_frame(frame_message, results),
        "broadcast": per_frame(
            lambda r: vmc.encode(
                unity_pose(r.frame_set.stage_time_ns * 1e-9, r.positions_m, r.rotations_wxyz)
            ),
            results,
        ),
    }


def finish(stage: Stage) -> Figures:
    """One output frame of a take that is solved as a whole, preset `finish`, all of it together."""
    frames = [
        camera_frame(camera, stage.joint_set, message)
        for camera, data in stage.messages
        if isinstance(message := wire.decode(data), wire.SkeletonFrame)
    ]
    begin = time.perf_counter()
    poses = solve_frames(frames, stage.calibration, preset("finish"))
    each_ms = (time.perf_counter() - begin) * 1e3 / poses.frame_count
    return {
        "median_ms": each_ms,
        "p99_ms": each_ms,
        "cpu_p99_ms": each_ms,
        "frames_per_second": 1e3 / each_ms,
        "ratio_to_mink_frame_tasks": None,
    }


def completion(stage: Stage, sets: list[FrameSet], fused: list[FusedSkeleton]) -> Figures:
    """One output frame of what completes the solve: floor contact, look-at, hands."""
    performer = stage.calibration.performer
    body = Body(performer, SETTINGS)
    floor = FloorContact(Skeleton.of(performer))
    look_at, hands = LookAt(SETTINGS.look_at, SETTINGS.look_at_point_m), Hands(SETTINGS.hands)
    poses = [body.pose_of_cameras(frame_set, OUTPUT_S)[1] for frame_set in sets]
    solved = [
        (skeleton, frame_set, pose[0], matrices(pose[1]))
        for skeleton, frame_set, pose in zip(fused, sets, poses, strict=True)
        if pose is not None
    ]

    def work(item: tuple[FusedSkeleton, FrameSet, NDArray[np.float64], NDArray[np.float64]]) -> None:
        skeleton, frame_set, positions, rotations = item
        floor.targets(skeleton.positions, skeleton.sigma, OUTPUT_S)
        look_at.apply(positions, rotations, frame_set.head_wxyz, OUTPUT_S)
        hands.apply(rotations, frame_set.hands, OUTPUT_S)
        floor.lift(positions)

    return per_frame(work, solved)


def pipeline(stage: Stage) -> tuple[Figures, list[StepResult]]:
    """One output frame of all that the live stage does: messages to pose, from bytes."""
    whole, schedule = Pipeline(stage.calibration, SETTINGS), Schedule.of(SETTINGS)
    results: list[StepResult] = []
    batches, waiting = [], []
    newest: dict[str, int] = {}
    for camera, data in stage.messages:
        waiting.append((camera, data))
        message = wire.decode(data)
        assert isinstance(message, wire.SkeletonFrame)
        newest[camera] = message.device_time_ns
        for due in schedule.due(newest):
            batches.append((waiting, due))
            waiting = []

    def work(batch: tuple[list[tuple[str, bytes]], int]) -> None:
        for camera, data in batch[0]:
            message = wire.decode(data)
            assert isinstance(message, wire.SkeletonFrame)
            whole.add_frame(camera_frame(camera, stage.joint_set, message))
        result = whole.step(batch[1])
        if result is not None:
            results.append(result)

    return per_frame(work, batches), results


def exports(poses: Poses) -> dict[str, Figures]:
    """One frame of an export, as a share of a whole file of the poses, written a few times; a format whose package is
    not installed is left out."""
    out: dict[str, Figures] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in EXPORTERS:
            paths = [Path(folder) / f"{k}.{name}" for k in range(WARM_UP + 3)]
            try:
                whole = per_frame(partial(export, poses, format=name), paths)
            except NotAvailableError:
                continue
            out[f"export_{name}"] = {
                "median_ms": whole["median_ms"] / poses.frame_count,
                "p99_ms": whole["p99_ms"] / poses.frame_count,
                "cpu_p99_ms": whole["cpu_p99_ms"] / poses.frame_count,
                "frames_per_second": whole["frames_per_second"] * poses.frame_count,
                "ratio_to_mink_frame_tasks": None,
            }
    return out
