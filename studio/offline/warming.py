"""Prepares a process for solving: loads and compiles everything that is slow at its first call."""

from dataclasses import replace

import numpy as np

from studio import wire
from studio.engine.identity.crowd import Crowd
from studio.engine.model.calibration import Performer
from studio.engine.model.cameras.lens import Lens, usual_lens
from studio.engine.model.frames import CameraFrame, PictureJoints
from studio.engine.model.human.face import PLACES_M
from studio.engine.model.human.hand import LANDMARKS as HAND_LANDMARKS
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings, preset
from studio.engine.solve.ik.reseed import LimbReseed
from studio.engine.whole_take.residuals import SolveResiduals
from studio.engine.whole_take.take import solve_frames
from studio.engine.whole_take.trace import TraceCollector
from studio.simulator.demo import DemoStage, make_stage
from studio.take.raw.records import camera_frame

SECONDS = 0.4


def prepare() -> None:
    """Make ready for any solve; results are discarded."""
    prepare_one()
    prepare_pictures()
    prepare_several()


def prepare_one() -> None:
    """Solve a moment of the embedded performer with preset `studio`, as depth cameras see it; and search limbs."""
    stage = make_stage(SECONDS)
    solve_stage(stage, preset("studio"))
    _find_limbs(stage.performer)


def prepare_pictures() -> None:
    """Solve a moment as cameras without depth see it, with something like hands and a face."""
    stage = make_stage(SECONDS)
    lens = usual_lens(1280, 720)
    cameras = {name: replace(camera, lens=lens) for name, camera in stage.calibration.cameras.items()}
    frames = [_pictured(frame, lens) for frame in _frames(stage)]
    solve_frames(frames, replace(stage.calibration, cameras=cameras), preset("studio"))


def prepare_several() -> None:
    """Tell two performers apart."""
    _tell_apart(_frames(make_stage(0.1))[:2])


def solve_stage(stage: DemoStage, settings: SolveSettings) -> Poses:
    """Return the poses of the simulated stage's performer, solved with these settings."""
    return solve_frames(
        _frames(stage), stage.calibration, settings, residuals=SolveResiduals(), trace=TraceCollector()
    )


def _frames(stage: DemoStage) -> list[CameraFrame]:
    frames = []
    for name, data in stage.messages:
        message = wire.decode(data)
        assert isinstance(message, wire.SkeletonFrame)
        frames.append(camera_frame(name, stage.joint_set, message))
    return frames


def _pictured(frame: CameraFrame, lens: Lens) -> CameraFrame:
    seen = lens.pixels_of(frame.positions)
    turns = np.linspace(0.0, 6.0, HAND_LANDMARKS)
    about = 30.0 * np.column_stack([np.cos(turns), np.sin(turns)])
    hands = seen[[INDEX["left_wrist"], INDEX["right_wrist"]], None] + about
    face = seen[INDEX["head"]] + 200.0 * PLACES_M[:, [0, 2]] * [1.0, -1.0]
    world_m = frame.positions - frame.positions[INDEX["hips"]]
    picture = PictureJoints(lens.width, lens.height, seen, world_m, hands, face)
    return replace(frame, positions=np.full_like(frame.positions, np.nan), picture=picture)


def _find_limbs(performer: Performer) -> None:
    """Run the search of stuck limbs, which not every solve needs."""
    humanoid = build_humanoid(Skeleton.of(performer))
    joints, weights = np.zeros((JOINT_COUNT, 3)), np.ones(JOINT_COUNT)
    LimbReseed(humanoid, limited=True).settled(
        humanoid.rest_qpos, joints, joints + 1.0, weights, lambda: None
    )


def _tell_apart(frames: list[CameraFrame]) -> None:
    """Track two performers who stand next to each other."""
    crowd = Crowd()
    for k, frame in enumerate(frames):
        crowd.add(k * 0.03, np.stack([frame.positions, frame.positions + 1.0]))
