"""Prepares a process for solving: loads and compiles everything that is slow at its first call."""

import numpy as np

from studio import wire
from studio.engine.model.calibration import Performer
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.model.poses import Poses
from studio.engine.model.settings import SolveSettings, preset
from studio.engine.solve.ik.reseed import LimbReseed
from studio.engine.whole_take.residuals import SolveResiduals
from studio.engine.whole_take.take import solve_frames
from studio.engine.whole_take.trace import TraceCollector
from studio.simulator.demo import DemoStage, make_stage
from studio.take.raw.records import camera_frame

SECONDS = 0.7


def prepare() -> None:
    """Solve a moment of the embedded performer with the preset `studio`, search limbs, and discard the result."""
    stage = make_stage(SECONDS)
    solve_stage(stage, preset("studio"))
    _find_limbs(stage.performer)


def solve_stage(stage: DemoStage, settings: SolveSettings) -> Poses:
    """Return the poses of the simulated stage's performer, solved with these settings."""
    frames = []
    for name, data in stage.messages:
        message = wire.decode(data)
        assert isinstance(message, wire.SkeletonFrame)
        frames.append(camera_frame(name, stage.joint_set, message))
    return solve_frames(
        frames, stage.calibration, settings, residuals=SolveResiduals(), trace=TraceCollector()
    )


def _find_limbs(performer: Performer) -> None:
    """Run the search of stuck limbs, which not every solve needs."""
    humanoid = build_humanoid(Skeleton.of(performer))
    joints, weights = np.zeros((JOINT_COUNT, 3)), np.ones(JOINT_COUNT)
    LimbReseed(humanoid, limited=True).settled(
        humanoid.rest_qpos, joints, joints + 1.0, weights, lambda: None
    )
