"""Azure Kinect, ROS and raw files: what was written comes back, what was cut gives what it holds."""

import shutil
import sqlite3
import time
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, TakeError
from studio.engine.model.cameras.depth import DepthCamera
from studio.take.importers import import_recording
from studio.take.library.exports.depth_export import export_depth
from studio.take.library.exports.k4a_writer import write_k4a
from studio.take.raw.depth import depth_cameras, depth_frames
from studio.take.raw.frames import camera_frames
from tests.refused import refused
from tests.take.test_raw_depth import depth_take, image

CAMERA = DepthCamera(
    504.6, 504.7, 332.8, 348.8, 640, 576, (0.5479, -0.021, 2.1e-5, -7.2e-5, -0.0027, 0.8897, 0.0861, -0.0139)
)


def big_image(k: int) -> np.ndarray:
    return np.random.default_rng(k).integers(0, 6000, (576, 640)).astype(np.uint16)


def k4a_file(path: Path, count: int = 4) -> Path:
    frames = ((5_000_000_000 + k * 33_333_000, big_image(k)) for k in range(count))
    assert write_k4a(path, CAMERA, frames, serial="0042") == count
    return path


def test_an_azure_kinect_file_comes_back(tmp_path: Path) -> None:
    take = import_recording(k4a_file(tmp_path / "a.mkv"), tmp_path / "take")
    assert take.meta["cameras"][0]["serial"] == "0042" and take.meta["notes"] == ""
    camera = depth_cameras(take.raw_path)["camera_0"]
    np.testing.assert_allclose(camera.distortion, CAMERA.distortion, rtol=1e-12)
    np.testing.assert_allclose([camera.fx, camera.fy, camera.cx, camera.cy], [504.6, 504.7, 332.8, 348.8])
    frames = list(depth_frames(take.raw_path))
    assert [f.device_time_ns for f in frames] == [5_000_000_000 + k * 33_333_000 for k in range(4)]
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.depth_mm, big_image(k))


def test_the_depth_of_a_take_becomes_an_azure_kinect_file(tmp_path: Path) -> None:
    take = import_recording(k4a_file(tmp_path / "a.mkv"), tmp_path / "take")
    assert export_depth(take, tmp_path / "b.mkv") == ("camera_0", 4)
    assert (tmp_path / "b.mkv").read_bytes() == (tmp_path / "a.mkv").read_bytes()
    with refused(TakeError, "depth.no_such_camera", name="x", names=["camera_0"]):
        export_depth(take, tmp_path / "c.mkv", "x")
    two = depth_take(tmp_path / "two", 3)
    with refused(TakeError, "depth.choose_camera", names=["camera_0", "camera_1"]):
        export_depth(two, tmp_path / "c.mkv")
    with refused(FormatError, "depth.k4a_size", height=30, width=40):
        export_depth(two, tmp_path / "c.mkv", "camera_1")
    assert not (tmp_path / "c.mkv").exists()


def test_a_cut_azure_kinect_file_gives_what_it_holds(tmp_path: Path) -> None:
    data = k4a_file(tmp_path / "a.mkv").read_bytes()
    (tmp_path / "cut.mkv").write_bytes(data[: int(0.6 * len(data))])
    take = import_recording(tmp_path / "cut.mkv", tmp_path / "take")
    assert len(list(depth_frames(take.raw_path))) == 2
    assert "cut.mkv was cut or not finished; the 2 images" in take.meta["notes"]
    for size in (0, 200, 1500):
        (tmp_path / "cut.mkv").write_bytes(data[:size])
        with refused(FormatError, "import.not_matroska"):
            import_recording(tmp_path / "cut.mkv", tmp_path / f"take{size}")


def test_only_sizes_of_the_device_are_written(tmp_path: Path) -> None:
    kinect = DepthCamera(285.6, 285.6, 160, 120, 320, 240)
    with refused(
        FormatError, "depth.k4a_size", sizes="320 x 288, 640 x 576, 512 x 512, 1024 x 1024", width=320
    ):
        write_k4a(tmp_path / "x.mkv", kinect, [(0, np.zeros((240, 320), np.uint16))])
    with refused(FormatError, "depth.no_image"):
        write_k4a(tmp_path / "x.mkv", CAMERA, [])
    assert list(tmp_path.iterdir()) == []


def test_damage_anywhere_in_a_file_is_told_or_survived(tmp_path: Path) -> None:
    data = k4a_file(tmp_path / "a.mkv", 2).read_bytes()
    rng = np.random.default_rng(5)
    for k in range(25):
        start = int(rng.integers(0, 2500))
        (tmp_path / "b.mkv").write_bytes(data[:start] + rng.bytes(6) + data[start + 6 :])
        try:
            import_recording(tmp_path / "b.mkv", tmp_path / f"take{k}")
        except FormatError as error:
            assert "b.mkv" in str(error)


def test_a_folder_of_files_is_one_recording(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    k4a_file(tmp_path / "in" / "left.mkv", 2)
    k4a_file(tmp_path / "in" / "right.mkv", 3)
    take = import_recording(tmp_path / "in", tmp_path / "take")
    assert take.camera_names == ("left", "right")
    assert [f.camera for f in depth_frames(take.raw_path)] == ["left", "right", "left", "right", "right"]


def test_a_raw_file_by_itself(tmp_path: Path) -> None:
    take = depth_take(tmp_path / "take", 6)
    shutil.copy(take.raw_path, tmp_path / "alone.mcap")
    copy = import_recording(tmp_path / "alone.mcap", tmp_path / "copy")
    assert "hand states" in copy.meta["notes"]
    assert [f.sequence for f in camera_frames(copy.raw_path)["camera_1"]] == list(range(6))
    for frame in depth_frames(copy.raw_path):
        k = round(frame.device_time_ns / 33_333_333)
        np.testing.assert_array_equal(frame.depth_mm, image(int(frame.camera[-1]), k))
    data = depth_take(tmp_path / "long", 40).raw_path.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: int(0.6 * len(data))])
    assert (
        "what can be read was kept"
        in import_recording(tmp_path / "cut.mcap", tmp_path / "half").meta["notes"]
    )


def test_a_cut_realsense_bag_gives_what_it_holds(test_data: Path, tmp_path: Path) -> None:
    data = (test_data / "sensor_files" / "single_depth_color_640x480.bag").read_bytes()
    (tmp_path / "cut.bag").write_bytes(data[: int(0.8 * len(data))])
    take = import_recording(tmp_path / "cut.bag", tmp_path / "take")
    assert len(list(depth_frames(take.raw_path))) == 1 and "the 1 images" in take.meta["notes"]
    (tmp_path / "cut.bag").write_bytes(data[: int(0.3 * len(data))])
    with refused(FormatError, "import.no_message"):
        import_recording(tmp_path / "cut.bag", tmp_path / "none")


def realsense_file(path: Path, count: int = 10) -> Path:
    """A recording written by the RealSense SDK from a device that is only software."""
    rs = pytest.importorskip("pyrealsense2")
    device = rs.software_device()
    sensor = device.add_sensor("Stereo Module")
    intrinsics = rs.intrinsics()
    intrinsics.width, intrinsics.height, intrinsics.model = 64, 48, rs.distortion.brown_conrady
    intrinsics.fx = intrinsics.fy = 39.0
    intrinsics.ppx, intrinsics.ppy, intrinsics.coeffs = 32.5, 24.5, [0.0] * 5
    stream = rs.video_stream()
    stream.type, stream.index, stream.uid, stream.fmt, stream.bpp = rs.stream.depth, 0, 1, rs.format.z16, 2
    stream.width, stream.height, stream.fps, stream.intrinsics = 64, 48, 30, intrinsics
    profile = sensor.add_video_stream(stream).as_video_stream_profile()
    sensor.add_read_only_option(rs.option.depth_units, 0.0001)
    device.register_info(rs.camera_info.name, "Software D435")
    recorded = rs.recorder(str(path), device).query_sensors()[0]
    queue = rs.frame_queue(count)
    recorded.open(recorded.get_stream_profiles()[0])
    recorded.start(queue)
    for k in range(count):
        frame = rs.software_video_frame()
        frame.pixels = np.full((48, 64), 10_000 + 10 * k, np.uint16)
        frame.bpp, frame.stride, frame.profile = 2, 128, profile
        frame.timestamp, frame.domain, frame.frame_number = (
            1000.0 + 100 * k,
            rs.timestamp_domain.hardware_clock,
            k + 1,
        )
        sensor.on_video_frame(frame)
        time.sleep(0.01)
    recorded.stop()
    recorded.close()
    return path


def test_a_file_of_the_realsense_sdk(tmp_path: Path) -> None:
    take = import_recording(realsense_file(tmp_path / "a.db3"), tmp_path / "take")
    assert take.meta["cameras"][0]["device"] == "Software D435"
    assert take.meta["cameras"][0]["frames_per_second"] == 10.0
    frames = list(depth_frames(take.raw_path))
    assert [f.device_time_ns for f in frames] == [1_000_000_000 + k * 100_000_000 for k in range(10)]
    assert [int(f.depth_mm[5, 5]) for f in frames] == [1000 + k for k in range(10)]  # a step is 0.1 mm
    data = (tmp_path / "a.db3").read_bytes()
    (tmp_path / "cut.db3").write_bytes(data[: int(0.7 * len(data))])
    half = import_recording(tmp_path / "cut.db3", tmp_path / "half")
    assert 0 < len(list(depth_frames(half.raw_path))) < 10 and "cut.db3: it is cut" in half.meta["notes"]


def test_a_database_that_is_no_bag(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "x.db3") as connection:
        connection.execute("CREATE TABLE a(b)")
    connection.close()
    with refused(FormatError, "import.no_message"):
        import_recording(tmp_path / "x.db3", tmp_path / "take")
