"""Benchmark of depth: rendering one simulated image, and the tracker with one and with three cameras."""

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.seeing.tracker.tracker import Tracker
from studio.lab.bench.timing import StageTiming, per_frame
from studio.simulator.body.performers import DEFAULT
from studio.simulator.performer.motion import perform
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage

_CAMERAS, _LIVE_HZ = 2, 15.0
_BEGIN_S = 2.0
"""Start time; before it, the demo's performer holds a T-pose."""


def depth_simulator(frames: int, sensor_name: str = "azure-kinect") -> StageTiming:
    """Return the timing of rendering; `share_of_live_budget` is the share of one core for two cameras at 15 Hz."""
    sensor = find_sensor(sensor_name)
    stage = DepthStage.of(sensor, standard_rig(_CAMERAS), perform(demo_motion(), DEFAULT), DEFAULT)
    camera = stage.camera(0)
    figures = per_frame(camera.image, [k / sensor.frames_per_second for k in range(frames)])
    share = figures["median_ms"] * 1e-3 * _CAMERAS * _LIVE_HZ
    return {**figures, "share_of_live_budget": share}


def tracker(frames: int, cameras: int) -> StageTiming:
    """Return the timing of one skeleton from one image per camera."""
    sensor, rig = find_sensor("azure-kinect"), standard_rig(cameras)
    stage = DepthStage.of(sensor, rig, perform(demo_motion(), DEFAULT), DEFAULT)
    images = [stage.camera(index) for index in range(cameras)]
    sets = []
    for k in range(frames):
        time_s = _BEGIN_S + k / sensor.frames_per_second
        sets.append(
            {
                camera.name: DepthFrame(camera.name, k, round(time_s * 1e9), image.image(time_s))
                for camera, image in zip(rig, images, strict=True)
            }
        )
    followed = Tracker(
        {camera.name: sensor.camera for camera in rig}, {camera.name: camera.T_stage_camera for camera in rig}
    )
    return per_frame(followed.track, sets)
