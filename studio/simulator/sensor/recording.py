"""`studio simulate --tracker depth`: depth images of all cameras in a take, and the ground truth."""

import heapq
from collections.abc import Callable, Iterator

import numpy as np

from studio import wire
from studio.engine.model.joints import CANONICAL
from studio.simulator.clock import SimulatedClock, random_clock
from studio.simulator.instants import instants
from studio.simulator.performer.motion import PerformerMotion
from studio.simulator.sensor.stage import DepthStage, dropped
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter
from studio.take.raw.records import intrinsics_of


def record_depth(take: Take, stage: DepthStage, progress: Callable[[float], None] | None = None) -> None:
    """Write every camera's depth images to the take's `raw.mcap`, ordered by capture time.

    Each camera has its own trigger and clock and loses frames; the first one's clock is the stage clock.

    Raises:
        FormatError: the motion is too short for one frame. TakeError: the take cannot be written.
    """
    end_s = stage.performance.motion.duration_s
    streams = [_images(stage, index, end_s) for index in range(len(stage.rig))]
    with RawWriter(take.raw_path) as raw:
        for camera in stage.rig:
            hello = wire.Hello(
                protocol_version=wire.PROTOCOL_VERSION,
                name=camera.name,
                device=f"simulated {stage.sensor.device}",
                joint_set="canonical",
                boot_id=f"simulate-{stage.seed}",
                frames_per_second=stage.sensor.frames_per_second,
                intrinsics=intrinsics_of(stage.sensor.camera),
            )
            raw.add_camera(hello)
            take.add_camera(hello)
        for time_s, index, image in heapq.merge(*streams, key=lambda item: item[:2]):
            raw.depth(
                stage.rig[index].name,
                wire.encode(image),
                arrival_ns=round(time_s * 1e9),
                device_time_ns=image.device_time_ns,
                sequence=image.sequence,
            )
            if progress is not None:
                progress(min(time_s / end_s, 1.0))


def _images(stage: DepthStage, index: int, end_s: float) -> Iterator[tuple[float, int, wire.DepthImage]]:
    """Yield one camera's images with the true time of each [s]."""
    rng = np.random.default_rng([stage.seed, index])
    clock = random_clock(rng)
    clock = SimulatedClock() if index == 0 else clock
    times = instants(rng, end_s, stage.sensor.frames_per_second)
    lost = dropped(rng, len(times))
    stamps = np.round(clock.device_s(times) * 1e9).astype(np.int64)
    camera = stage.camera(index)
    for sequence in np.nonzero(~lost)[0]:
        image = camera.image(float(times[sequence]))
        yield float(times[sequence]), index, wire.depth_image(int(sequence), int(stamps[sequence]), image)


def truth_csv(performance: PerformerMotion) -> bytes:
    """Return the true joints [m], the head's rotation (wxyz, from facing -y) and the openness of the hands, at 120
    Hz, from the performer's entrance.
    """
    motion = performance.motion
    names = [f"{name}_{axis}" for name in CANONICAL for axis in "xyz"]
    names += [f"head_rotation_{axis}" for axis in "wxyz"] + ["left_hand_open", "right_hand_open"]
    joints = motion.positions_m.reshape(motion.frame_count, -1)
    rows = np.column_stack([motion.times_s(), joints, performance.head_wxyz, motion.hands_open])
    rows = rows[rows[:, 0] >= performance.enters_s]
    lines = (",".join([f"{row[0]:.5f}", *(f"{value:.4f}" for value in row[1:])]) for row in rows)
    return "\n".join(["time_s," + ",".join(names), *lines, ""]).encode()
