"""One image of a simulated depth camera: body, clothes, room and noise."""

from studio.bench.timing import per_frame
from studio.camera.simulator.depth.motion import perform
from studio.camera.simulator.depth.performers import DEFAULT
from studio.camera.simulator.depth.sensors import find_sensor
from studio.camera.simulator.depth.stage import DepthStage
from studio.camera.simulator.rig import standard_rig
from studio.engine.motion.authored import demo_motion

_CAMERAS, _LIVE_HZ = 2, 15.0


def depth_simulator(frames: int, sensor_name: str = "azure-kinect") -> dict[str, float | None]:
    """Return the figures of rendering; `share_of_live_budget` is what two cameras at 15 Hz take of one core."""
    sensor = find_sensor(sensor_name)
    stage = DepthStage.of(sensor, standard_rig(_CAMERAS), perform(demo_motion(), DEFAULT), DEFAULT)
    camera = stage.camera(0)
    figures = per_frame(camera.image, [k / sensor.frames_per_second for k in range(frames)])
    median_ms = figures["median_ms"]
    assert median_ms is not None
    return figures | {"share_of_live_budget": median_ms * 1e-3 * _CAMERAS * _LIVE_HZ}
