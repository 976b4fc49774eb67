import asyncio
import shutil
import time

import numpy as np
import pytest

from studio.camera.simulated.depth_config import SimulatedDepthConfig
from studio.camera.simulated.landmarks import SimulatedRgbConfig
from studio.camera.simulated.skeletons import SimulatedConfig, SimulatedSource
from studio.camera.sources.config import DeviceConfig
from studio.camera.sources.depth_source import DepthSource, DeviceLostError
from studio.camera.sources.recording import RecordingConfig
from studio.camera.sources.registry import SOURCES, open_source, written
from studio.camera.sources.source import Source
from studio.camera.sources.video import VideoConfig
from studio.engine.base.errors import FormatError, NotAvailableError, SettingsError
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.joints import CANONICAL, JOINT_SETS
from studio.simulator.simulate import simulate_take
from studio.take.raw.frames import camera_frames
from studio.wire import is_camera_name
from tests.engine.animation.motion.bvh_files import MIXAMO, bvh_text, channel_count
from tests.refused import refused
from tests.take.test_raw_depth import png_camera


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recording")
    frame = [0.0, 95.0, 0.0] + [0.0] * (channel_count(MIXAMO) - 3)
    (folder / "motion.bvh").write_text(bvh_text(MIXAMO, [frame] * 61, frame_s=1 / 30))
    return simulate_take(folder / "motion.bvh", folder / "take", cameras=2, unit_m=0.01, calibration=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A recording of two cameras in which only the hips are seen, 0.2 s long."""
    folder = tmp_path_factory.mktemp("folder")
    header = "time_s," + ",".join(
        f"{name}_{part}" for name in CANONICAL for part in ("x", "y", "z", "confidence")
    )
    for k in range(2):
        rows = [f"{1 + i / 30:.5f},0.1,0.2,3.{i},0.9" + "," * 80 for i in range(8)]
        (folder / f"camera_{k}").mkdir()
        (folder / f"camera_{k}" / "joints.csv").write_text("\n".join([header, *rows, ""]))
    return folder


async def take_frames(source, count):
    return [frame async for _, frame in _zip(range(count), source.frames())]


async def _zip(numbers, frames):
    for number in numbers:
        try:
            yield number, await anext(frames)
        except StopAsyncIteration:
            return


def configurations(take, folder):
    """Every kind of source that runs without a device: skeletons, depth, in real time, at full speed."""
    png_camera(folder / "images" / "camera_0", 0, 12)
    return [
        SimulatedConfig(0, 1),
        SimulatedConfig(3, 4, seed=7),
        SimulatedDepthConfig(0, 2),
        SimulatedRgbConfig(1, 2),
        RecordingConfig(take, "camera_1"),
        RecordingConfig(folder, "camera_0", speed="max"),
        RecordingConfig(folder / "images"),
        RecordingConfig(folder / "images", speed="max"),
    ]


def test_the_contract_runs_every_kind_but_devices(take, tmp_path):
    """Videos need a real person: `test_pictures.py` runs them."""
    kinds = {kind.config() for kind in SOURCES.values()}
    tried = {type(config) for config in configurations(take, tmp_path)}
    assert tried | {VideoConfig} == {kind for kind in kinds if not issubclass(kind, DeviceConfig)}


@pytest.mark.parametrize("index", range(7))
def test_every_source_keeps_the_contract(take, folder, index, tmp_path):
    shutil.copytree(folder, tmp_path / "in")
    source = configurations(take, tmp_path / "in")[index].open()
    assert is_camera_name(source.name) and source.device and source.serial == source.problem == ""
    assert 20 < source.frames_per_second < 40
    begun_ns = time.monotonic_ns()
    frames = asyncio.run(asyncio.wait_for(take_frames(source, 5), 120))
    assert len(frames) == 5
    if isinstance(source, Source):
        stamps = [frame.device_time_ns for frame in frames]
        late_ns = source.clock_ns() - stamps[-1]
        assert abs(late_ns) < 200_000_000 + time.monotonic_ns() - begun_ns  # a busy machine looks later
        check_skeletons(source, frames)
    else:
        stamps = [time_ns for time_ns, _ in frames]
        check_images(source, frames)
    assert stamps == sorted(set(stamps)) and stamps[0] >= 0


def check_skeletons(source, frames):
    joints = len(JOINT_SETS[source.joint_set])
    assert (source.tracked_ns, source.newest_depth, source.intrinsics) == (0, None, None)
    for frame in frames:
        assert frame.positions.shape == (joints, 3) and frame.confidence.shape == (joints,)
        assert ((frame.confidence >= 0) & (frame.confidence <= 1)).all()


def check_images(source, shots):
    assert isinstance(source, DepthSource) and isinstance(source.camera, DepthCamera)
    for _, depth_mm in shots:
        assert depth_mm.dtype == np.uint16 and depth_mm.shape == (source.camera.height, source.camera.width)


def test_the_registry_names_its_kinds():
    with pytest.raises(SettingsError) as error:
        open_source("magic:1")
    for name in SOURCES:
        assert written(name) in str(error.value)
    assert written("realsense") == "realsense[:<serial>]" and written("kinect-v2") == "kinect-v2[?bodies]"


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", SettingsError),
        ("webcam:x", SettingsError),
        ("webcam:99", DeviceLostError),
        ("video:/nowhere.mp4", FormatError),
        ("video:/etc/hostname", FormatError),
        ("openni:x", SettingsError),
        ("kinect-v2?bones", SettingsError),
        ("orbbec", NotAvailableError),
        ("openni", NotAvailableError),
        ("azure-kinect", NotAvailableError),
        ("kinect-v2", NotAvailableError),
        ("simulated", SettingsError),
        ("simulated:2/2", SettingsError),
        ("simulated:0/9", SettingsError),
        ("simulated:-1/2", SettingsError),
        ("simulated:0/2:x", SettingsError),
        ("recording:/nowhere", FormatError),
        ("recording:/etc/hostname", FormatError),
    ],
)
def test_sources_that_cannot_be_opened(text, error):
    with pytest.raises(error):
        open_source(text)


def test_cameras_of_one_stage_watch_the_same_performer_with_clocks_of_their_own():
    a, b, c = SimulatedSource(0, 2), SimulatedSource(1, 2), SimulatedSource(0, 2)
    now = 1_700_000_000_123_456_789
    assert a.performer_s(now) == b.performer_s(now)
    np.testing.assert_array_equal(a.frame_at(now).positions, c.frame_at(now).positions)
    assert abs(a.clock_ns() - b.clock_ns()) > 1_000_000
    assert abs(a.clock_ns() - c.clock_ns()) < 50_000_000


def test_a_take_once_as_fast_as_it_goes(take):
    frames = asyncio.run(take_frames(open_source(f"recording:{take}#camera_1?speed=max"), 1000))
    recorded = camera_frames(take / "raw.mcap")["camera_1"]
    assert [frame.device_time_ns for frame in frames] == [frame.device_time_ns for frame in recorded]
    np.testing.assert_array_equal([f.positions for f in frames], [f.positions for f in recorded])


def test_a_recording_repeats_in_step_for_all_clients(folder):
    async def both():
        sources = [open_source(f"recording:{folder}#camera_{k}") for k in (0, 1)]
        return await asyncio.gather(*(take_frames(source, 10) for source in sources))

    first, second = asyncio.run(both())
    by_time = {frame.device_time_ns: frame.positions[0, 2] for frame in first}
    shared = [frame for frame in second if frame.device_time_ns in by_time]
    assert len(shared) >= 5
    assert all(frame.positions[0, 2] == by_time[frame.device_time_ns] for frame in shared)


def test_a_recording_of_several_cameras_needs_one(folder):
    with refused(SettingsError, "source.recording_camera", names=["camera_0", "camera_1"]):
        open_source(f"recording:{folder}")
    with refused(SettingsError, "source.recording_camera", names=["camera_0", "camera_1"]):
        open_source(f"recording:{folder}#camera_7")
    with refused(SettingsError, "value.bad", allowed=["1", "max"]):
        open_source(f"recording:{folder}#camera_0?speed=fast")
