"""Makes a process ready to solve: whatever is loaded or compiled at its first call is there afterwards."""

import numpy as np

from studio import wire
from studio.bench.stage import make_stage
from studio.engine.calibration.result import Performer
from studio.engine.human.model import build_humanoid
from studio.engine.human.skeleton import Skeleton
from studio.engine.joints import JOINT_COUNT
from studio.engine.settings import preset
from studio.engine.solve.following import Following
from studio.engine.solve.reseed import LimbWatch
from studio.engine.solve.take import solve_frames
from studio.engine.solve.trace import TraceCollector
from studio.take.raw_records import camera_frame

SECONDS = 0.7


def prepare() -> None:
    """Solve a moment of the embedded performer with the preset `studio`, find lost limbs, and keep nothing."""
    stage = make_stage(SECONDS)
    frames = []
    for name, data in stage.messages:
        message = wire.decode(data)
        assert isinstance(message, wire.SkeletonFrame)
        frames.append(camera_frame(name, stage.joint_set, message))
    solve_frames(frames, stage.calibration, preset("studio"), following=Following(), trace=TraceCollector())
    _find_limbs(stage.calibration.performer)


def _find_limbs(performer: Performer | None) -> None:
    """Look for limbs that are off: what does it is not called in every solve."""
    assert performer is not None
    humanoid = build_humanoid(Skeleton.of(performer))
    joints, weights = np.zeros((JOINT_COUNT, 3)), np.ones(JOINT_COUNT)
    LimbWatch(humanoid, limited=True).settled(humanoid.rest_qpos, joints, joints + 1.0, weights, lambda: None)
