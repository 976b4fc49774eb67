"""Compiles in advance, once after installation, what the first takes call. The result is kept on disk."""

import multiprocessing
import os
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from studio.engine.animation.export import export
from studio.engine.animation.motion.authored import stage_motion
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.model.settings.settings import preset
from studio.engine.seeing.tracker.skeletons import from_points, per_camera
from studio.offline.warming import SECONDS, prepare, solve_stage
from studio.simulator.body.performers import DEFAULT
from studio.simulator.demo import make_stage
from studio.simulator.performer.motion import perform
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage

_IMAGES = 12
_HZ = 30.0


def compile_ahead(progress: Callable[[float], None] | None = None) -> None:
    """Run solving, finishing and an export on a moment of the embedded performer; in parallel, tracking in depth.

    What they compile is kept next to the source or in the user's cache folder, where a later process finds it.

    Args:
        progress: receives the share done.
    """
    processes = min(len(STEPS), os.cpu_count() or 1)
    with ProcessPoolExecutor(processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        running = [pool.submit(step) for step in STEPS]
        for done, step in enumerate(as_completed(running)):
            step.result()
            if progress is not None:
                progress((done + 1) / len(running))


def _solve() -> None:
    """Solve live and finish a moment, and export it."""
    prepare()
    poses = solve_stage(make_stage(SECONDS), preset("finish"))
    with tempfile.TemporaryDirectory() as folder:
        export(poses, Path(folder) / "moment.fbx", "fbx", key_error_cm=0.1)


def _see_depth() -> None:
    """Track the performer in simulated depth images, in one camera alone and in the points of all."""
    sensor, rig = find_sensor("azure-kinect"), standard_rig(1)
    camera = DepthStage.of(sensor, rig, perform(stage_motion(), DEFAULT), DEFAULT).camera(0)
    name, T_stage_camera = rig[0].name, rig[0].T_stage_camera
    frames = [DepthFrame(name, k, round(k * 1e9 / _HZ), camera.image(k / _HZ)) for k in range(_IMAGES)]
    cameras = {name: sensor.camera}
    calibration = Calibration(name, {name: CameraCalibration(T_stage_camera)}, None)
    for _ in per_camera(frames, cameras):
        pass
    for _ in from_points(frames, cameras, calibration):
        pass


STEPS = (_solve, _see_depth)
"""The steps of compilation, which run in parallel."""
