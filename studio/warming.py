"""Makes a process ready to solve: whatever is loaded or compiled at its first call is there afterwards."""

from studio import wire
from studio.bench.stage import make_stage
from studio.engine.settings import preset
from studio.engine.solve.following import Following
from studio.engine.solve.take import solve_frames
from studio.engine.solve.trace import TraceCollector
from studio.take.raw_records import camera_frame

SECONDS = 0.7


def prepare() -> None:
    """Solve a moment of the embedded performer with the preset `studio`, and keep nothing."""
    stage = make_stage(SECONDS)
    frames = []
    for name, data in stage.messages:
        message = wire.decode(data)
        assert isinstance(message, wire.SkeletonFrame)
        frames.append(camera_frame(name, stage.joint_set, message))
    solve_frames(frames, stage.calibration, preset("studio"), following=Following(), trace=TraceCollector())
