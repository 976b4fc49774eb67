"""The measured stages; each takes the results of the previous stage as input."""

import tempfile
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.engine.animation.export import EXPORTERS, export
from studio.engine.base.errors import NotAvailableError
from studio.engine.base.geometry import matrices
from studio.engine.identity.known import KnownPerson
from studio.engine.model.frames import CameraFrame, FrameSet, FusedSkeleton, StepResult
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import PARENTS
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings, preset
from studio.engine.solve.body import BodySolver
from studio.engine.solve.completion.floor import FloorContact
from studio.engine.solve.completion.hands import Hands
from studio.engine.solve.completion.look_at import LookAt
from studio.engine.solve.conditioning.filters import FILTERS
from studio.engine.solve.fusion import make_fusion
from studio.engine.solve.ik.solver import Solver
from studio.engine.solve.people import PeoplePipeline
from studio.engine.solve.pipeline import Pipeline
from studio.engine.solve.timing.schedule import Schedule
from studio.engine.solve.timing.sync import Synchroniser
from studio.engine.whole_take.take import solve_frames
from studio.lab.bench.plain_mink import PlainMink, RetargetingMink
from studio.lab.bench.timing import WARM_UP, StageTiming, per_frame
from studio.simulator.demo import APART, DemoStage
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND
from studio.streams.cast import Member
from studio.streams.frames import frame_message
from studio.streams.unity import unity_pose
from studio.streams.vmc import VmcEncoder
from studio.take.raw.frames import RawWriter, camera_frame

SETTINGS: SolveSettings = preset("studio")
OUTPUT_S = 1.0 / SETTINGS.output_hz


def parse(stage: DemoStage) -> tuple[StageTiming, list[CameraFrame]]:
    """One message of one camera: from bytes to canonical joints."""
    frames: list[CameraFrame] = []

    def work(item: tuple[str, bytes]) -> None:
        message = wire.decode(item[1])
        assert isinstance(message, wire.SkeletonFrame)
        frames.append(camera_frame(item[0], stage.joint_set, message))

    return per_frame(work, stage.messages), frames


def record(stage: DemoStage) -> StageTiming:
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


def sync(stage: DemoStage, frames: list[CameraFrame]) -> tuple[StageTiming, list[FrameSet]]:
    """One output frame: adds the frames since the last one and returns all cameras at one instant."""
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


def fusion(sets: list[FrameSet]) -> tuple[StageTiming, list[FusedSkeleton]]:
    """One output frame: all cameras' skeletons fused into one, for a solve without the cameras' own joints."""
    fuse, fused = make_fusion(SETTINGS), []
    figures = per_frame(lambda frame_set: fused.append(fuse.fuse(frame_set)), sets)
    return figures, fused


def solve(stage: DemoStage, sets: list[FrameSet]) -> StageTiming:
    """One output frame from the cameras' joints to the pose, with fusion and completion, as in preset `studio`."""
    body = BodySolver(stage.performer, SETTINGS)
    return per_frame(lambda frame_set: body.pose_of_cameras(frame_set, OUTPUT_S), sets)


def solve_mink(stage: DemoStage, fused: list[FusedSkeleton]) -> StageTiming:
    """One output frame of `ik=previous_pose`, two iterations of mink, body only."""
    humanoid = build_humanoid(Skeleton.of(stage.performer))
    solver = Solver(humanoid, replace(SETTINGS, ik="previous_pose"))
    return per_frame(lambda skeleton: solver.solve(skeleton.positions, skeleton.sigma, OUTPUT_S), fused)


def mink_frame_tasks(stage: DemoStage, fused: list[FusedSkeleton]) -> StageTiming:
    """The same frame by plain mink, for comparison."""
    solver = PlainMink(build_humanoid(Skeleton.of(stage.performer)))
    return per_frame(lambda skeleton: solver.solve(skeleton.positions), fused)


def retargeting_mink(stage: DemoStage, fused: list[FusedSkeleton]) -> StageTiming:
    """The same frame by mink with the settings of General Motion Retargeting, for comparison."""
    solver = RetargetingMink(build_humanoid(Skeleton.of(stage.performer)))
    return per_frame(lambda skeleton: solver.solve(skeleton.positions), fused)


def filters(fused: list[FusedSkeleton]) -> dict[str, StageTiming]:
    """One output frame of each filter on the fused joints."""
    out = {}
    for name, make in FILTERS.items():
        one = make()
        out[f"filter_{name}"] = per_frame(lambda s, one=one: one.apply(s.positions, OUTPUT_S), fused)
    return out


def sending(results: list[StepResult]) -> dict[str, StageTiming]:
    """One output frame as bytes: for programs by WebSocket (`encode`), for receivers by VMC (`broadcast`)."""
    vmc = VmcEncoder()
    return {
        "encode": per_frame(lambda r: frame_message([(r, Member("", None))]), results),
        "broadcast": per_frame(
            lambda r: vmc.encode(
                unity_pose(r.frame_set.stage_time_ns * 1e-9, r.positions_m, r.rotations_wxyz)
            ),
            results,
        ),
    }


def finish(stage: DemoStage) -> StageTiming:
    """One output frame of a whole take, preset `finish`, all steps together."""
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


def completion(stage: DemoStage, sets: list[FrameSet], fused: list[FusedSkeleton]) -> StageTiming:
    """One output frame of the completion: floor contact, look-at, hands."""
    performer = stage.performer
    body = BodySolver(performer, SETTINGS)
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


def pipeline(stage: DemoStage) -> tuple[StageTiming, list[StepResult]]:
    """One output frame of the whole live stage: from the messages' bytes to the pose."""
    whole = Pipeline(stage.calibration, SETTINGS)
    results: list[StepResult] = []

    def work(batch: tuple[list[tuple[str, bytes]], int]) -> None:
        for camera, data in batch[0]:
            whole.add_frame(_decoded(stage, camera, data))
        result = whole.step(batch[1])
        if result is not None:
            results.append(result)

    return per_frame(work, _batches(stage)), results


def people_pipeline(stage: DemoStage, performers: int) -> StageTiming:
    """One output frame of the whole live stage with several performers, all known in advance."""
    rest = stage.performer.offsets_m.copy()
    for joint, parent in enumerate(PARENTS):
        rest[joint] += rest[parent] if parent >= 0 else 0.0
    bones = np.where(PARENTS < 0, 0.0, np.linalg.norm(stage.performer.offsets_m, axis=1))
    known = [
        KnownPerson(who + 1, stage.performer if who else None, bones, rest + who * APART, 0.0)
        for who in range(performers)
    ]
    whole = PeoplePipeline(stage.calibration, SETTINGS, known)

    def work(batch: tuple[list[tuple[str, bytes]], int]) -> None:
        for camera, data in batch[0]:
            whole.add_frame(_decoded(stage, camera, data))
        whole.step(batch[1])

    return per_frame(work, _batches(stage))


def _decoded(stage: DemoStage, camera: str, data: bytes) -> CameraFrame:
    message = wire.decode(data)
    assert isinstance(message, wire.SkeletonFrame)
    return camera_frame(camera, stage.joint_set, message)


def _batches(stage: DemoStage) -> list[tuple[list[tuple[str, bytes]], int]]:
    """Return the messages that arrive before each output frame, and its stage time [ns]."""
    schedule = Schedule.of(SETTINGS)
    batches: list[tuple[list[tuple[str, bytes]], int]] = []
    waiting: list[tuple[str, bytes]] = []
    newest: dict[str, int] = {}
    for camera, data in stage.messages:
        waiting.append((camera, data))
        newest[camera] = _decoded(stage, camera, data).device_time_ns
        for due in schedule.due(newest):
            batches.append((waiting, due))
            waiting = []
    return batches


def exports(poses: Poses) -> dict[str, StageTiming]:
    """One frame of each export: the time of a whole file, written a few times, divided by its frames. Formats without
    their package are skipped.
    """
    out: dict[str, StageTiming] = {}
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
