"""Device modules: the RealSense one with the SDK's software device, the others with a fake SDK.

A fake SDK answers as the SDK's own interface files say; real cameras are not tested here.
"""

import asyncio
import sys
import threading
import time
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from studio.camera.devices import azure_kinect, kinect_v2, openni, orbbec
from studio.camera.devices.realsense import RealSenseConfig, RealSenseSource
from studio.camera.sources.depth_source import DepthSource, DeviceLostError
from studio.camera.sources.source import Source
from studio.engine.base.errors import NotAvailableError, SettingsError
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.joints import JOINT_SETS
from studio.take.importers.k4a import calibration_json
from tests.refused import refused

RAMP = np.arange(20 * 30, dtype=np.uint16).reshape(20, 30) + 1000


async def first(source, count: int) -> list:
    out = []
    async for item in source.frames():
        out.append(item)
        if len(out) == count:
            break
    return out


def check_depth(source, shots: list) -> None:
    """What every source of depth keeps."""
    assert isinstance(source, DepthSource) and source.name and source.device and source.realtime
    assert 5 <= source.frames_per_second <= 90
    assert isinstance(source.camera, DepthCamera) and source.camera.fx > 1
    times = [time_ns for time_ns, _ in shots]
    assert times == sorted(set(times)) and isinstance(source.clock_ns(), int)
    for _, depth_mm in shots:
        assert depth_mm.dtype == np.uint16 and depth_mm.shape == (source.camera.height, source.camera.width)


def sdk(monkeypatch: pytest.MonkeyPatch, name: str, **content: object) -> ModuleType:
    parts = name.split(".")
    for k in range(1, len(parts) + 1):
        dotted = ".".join(parts[:k])
        if dotted not in sys.modules or k == len(parts):
            monkeypatch.setitem(sys.modules, dotted, ModuleType(dotted))
    module = sys.modules[name]
    module.__dict__.update(content)
    return module


def test_realsense_with_the_software_device_of_its_sdk() -> None:
    rs = pytest.importorskip("pyrealsense2")
    with refused(DeviceLostError, "device.no_realsense"):
        RealSenseConfig().open()
    device = rs.software_device()
    sensor = device.add_sensor("Stereo Module")
    lens = rs.intrinsics()
    lens.width, lens.height, lens.fx, lens.fy, lens.ppx, lens.ppy = 30, 20, 25.0, 25.5, 14.5, 9.5
    lens.model, lens.coeffs = rs.distortion.brown_conrady, [0.0] * 5
    stream = rs.video_stream()
    stream.type, stream.uid, stream.fmt, stream.bpp, stream.intrinsics = (
        rs.stream.depth,
        1,
        rs.format.z16,
        2,
        lens,
    )
    stream.width, stream.height, stream.fps = 30, 20, 30
    profile = sensor.add_video_stream(stream).as_video_stream_profile()
    sensor.add_read_only_option(rs.option.depth_units, 0.001)
    device.register_info(rs.camera_info.name, "Software D435")
    source = RealSenseSource(rs, device)
    ended = threading.Event()

    def play() -> None:
        for k in range(6000):
            if ended.is_set():
                return
            frame = rs.software_video_frame()
            frame.pixels, frame.bpp, frame.stride, frame.profile = RAMP + np.uint16(k), 2, 60, profile
            frame.timestamp, frame.domain, frame.frame_number = (
                10.0 * k,
                rs.timestamp_domain.hardware_clock,
                k,
            )
            frame.depth_units = 0.001
            sensor.on_video_frame(frame)
            time.sleep(0.01)

    player = threading.Thread(target=play)
    player.start()
    try:
        shots = asyncio.run(asyncio.wait_for(first(source, 3), 60))
    finally:
        ended.set()
        player.join()
    check_depth(source, shots)
    assert source.device == "Software D435" and source.camera == DepthCamera(25.0, 25.5, 14.5, 9.5, 30, 20)
    assert (shots[0][1] - RAMP == shots[0][0] // 10_000_000).all()


def test_orbbec(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = iter(range(1000))
    depth = SimpleNamespace(
        get_data=lambda: (RAMP // 2).view(np.uint8).ravel(),
        get_depth_scale=lambda: 2.0,
        get_timestamp_us=lambda: next(numbers) * 33_000,
    )
    bent = SimpleNamespace(k1=0.1, k2=0.0, k3=0.0, k4=0.0, k5=0.0, k6=0.0, p1=0.01, p2=0.02)
    profile = SimpleNamespace(
        get_format=lambda: "y16",
        get_fps=lambda: 30,
        get_intrinsic=lambda: SimpleNamespace(fx=25.0, fy=25.0, cx=15.0, cy=10.0, width=30, height=20),
        get_distortion=lambda: bent,
    )
    pipeline = SimpleNamespace(
        get_stream_profile_list=lambda kind: SimpleNamespace(
            get_default_video_stream_profile=lambda: profile
        ),
        start=lambda config: None,
        stop=lambda: None,
        wait_for_frames=lambda ms: SimpleNamespace(get_depth_frame=lambda: depth),
    )
    info = SimpleNamespace(get_name=lambda: "Femto Bolt", get_serial_number=lambda: "7")
    devices = SimpleNamespace(
        get_count=lambda: 1,
        get_device_serial_number_by_index=lambda k: "7",
        get_device_by_index=lambda k: SimpleNamespace(get_device_info=lambda: info),
    )
    sdk(
        monkeypatch,
        "pyorbbecsdk",
        Context=lambda: SimpleNamespace(query_devices=lambda: devices),
        Pipeline=lambda device: pipeline,
        Config=lambda: SimpleNamespace(enable_stream=lambda profile: None),
        OBSensorType=SimpleNamespace(DEPTH_SENSOR=1),
        OBFormat=SimpleNamespace(Y16="y16", Z16="z16"),
    )
    with refused(DeviceLostError, "device.none_of"):
        orbbec.OrbbecConfig("8").open()
    source = orbbec.OrbbecConfig("7").open()
    shots = asyncio.run(first(source, 3))
    check_depth(source, shots)
    np.testing.assert_array_equal(shots[0][1], RAMP // 2 * 2)
    assert source.camera.distortion == (0.1, 0.0, 0.01, 0.02, 0.0, 0.0, 0.0, 0.0)


def test_openni(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = iter(range(1000))
    stream = SimpleNamespace(
        set_mirroring_enabled=lambda on: None,
        get_video_mode=lambda: SimpleNamespace(resolutionX=30, resolutionY=20, fps=30, pixelFormat=1),
        get_horizontal_fov=lambda: 1.0,
        get_vertical_fov=lambda: 0.7,
        start=lambda: None,
        stop=lambda: None,
        read_frame=lambda: SimpleNamespace(
            get_buffer_as_uint16=lambda: RAMP.tobytes(), width=30, height=20, timestamp=next(numbers) * 33_000
        ),
    )
    device = SimpleNamespace(
        get_device_info=lambda: SimpleNamespace(name=b"Kinect"), create_depth_stream=lambda: stream
    )

    class Device:
        enumerate_uris = staticmethod(lambda: [b"usb0"])

        def __new__(cls, uri: bytes) -> SimpleNamespace:
            return device

    sdk(monkeypatch, "primesense.utils")
    sdk(
        monkeypatch,
        "primesense.openni2",
        is_initialized=lambda: True,
        Device=Device,
        PIXEL_FORMAT_DEPTH_100_UM=2,
        OpenNIError=RuntimeError,
        wait_for_any_stream=lambda streams, timeout: streams[0],
    )
    source = openni.OpenNIConfig().open()
    shots = asyncio.run(first(source, 2))
    check_depth(source, shots)
    np.testing.assert_array_equal(shots[1][1], RAMP)
    assert source.camera.fx == pytest.approx(15 / np.tan(0.5))
    with refused(DeviceLostError, "device.no_openni", n=1, number=1):
        openni.OpenNIConfig(1).open()


def test_azure_kinect(monkeypatch: pytest.MonkeyPatch) -> None:
    camera = DepthCamera(252.0, 252.0, 160.0, 170.0, 320, 288)
    image = np.full((288, 320), 2000, np.uint16)
    device = SimpleNamespace(
        get_raw_calibration=lambda: calibration_json(camera),
        update=lambda: SimpleNamespace(get_depth_image=lambda: (True, image)),
        close=lambda: None,
    )
    place = SimpleNamespace(
        position=SimpleNamespace(xyz=SimpleNamespace(x=100.0, y=-200.0, z=2000.0)), confidence_level=2
    )
    bodies = SimpleNamespace(
        get_num_bodies=lambda: 1, get_body_skeleton=lambda k: SimpleNamespace(joints=[place] * 32)
    )
    sdk(
        monkeypatch,
        "pykinect_azure",
        initialize_libraries=lambda track_body: None,
        default_configuration=SimpleNamespace(),
        K4A_COLOR_RESOLUTION_OFF=0,
        K4A_DEPTH_MODE_NFOV_2X2BINNED=1,
        start_device=lambda device_index, config: device,
        start_body_tracker=lambda: SimpleNamespace(update=lambda: bodies),
    )
    source = azure_kinect.AzureKinectConfig().open()
    check_depth(source, asyncio.run(first(source, 2)))
    assert source.camera.cx == pytest.approx(160.0)
    source = azure_kinect.AzureKinectConfig(bodies=True).open()
    (frame,) = asyncio.run(first(source, 1))
    assert isinstance(source, Source) and source.joint_set == "azure-kinect"
    np.testing.assert_allclose(frame.positions[3], [0.1, -0.2, 2.0])
    assert frame.positions.shape == (len(JOINT_SETS["azure-kinect"]), 3) and frame.confidence[0] == 0.9


def test_kinect_v2(monkeypatch: pytest.MonkeyPatch) -> None:
    image = np.tile(np.arange(512, dtype=np.uint16) + 500, 424)
    lens = SimpleNamespace(
        FocalLengthX=365.0, FocalLengthY=366.0, PrincipalPointX=250.0, PrincipalPointY=207.0,
        RadialDistortionSecondOrder=0.09, RadialDistortionFourthOrder=-0.27, RadialDistortionSixthOrder=0.09,
    )  # fmt: skip
    joint = SimpleNamespace(Position=SimpleNamespace(x=0.5, y=1.0, z=2.0), TrackingState=1)
    body = SimpleNamespace(is_tracked=True, joints=[joint] * 25)
    runtime = SimpleNamespace(
        _mapper=SimpleNamespace(GetDepthCameraIntrinsics=lambda: lens),
        has_new_depth_frame=lambda: True,
        get_last_depth_frame=lambda: image,
        has_new_body_frame=lambda: True,
        get_last_body_frame=lambda: SimpleNamespace(bodies=[body]),
        close=lambda: None,
    )
    sdk(monkeypatch, "pykinect2.PyKinectV2", FrameSourceTypes_Body=1, FrameSourceTypes_Depth=2)
    sdk(monkeypatch, "pykinect2.PyKinectRuntime", PyKinectRuntime=lambda kind: runtime)
    source = kinect_v2.KinectV2Config().open()
    shots = asyncio.run(first(source, 2))
    check_depth(source, shots)
    assert shots[0][1][0, 0] == 500 + 511 and source.camera.cx == 511 - 250
    source = kinect_v2.KinectV2Config(bodies=True).open()
    (frame,) = asyncio.run(first(source, 1))
    assert isinstance(source, Source) and source.joint_set == "kinect-v2"
    np.testing.assert_allclose(frame.positions[0], [-0.5, -1.0, 2.0])
    assert frame.confidence[0] == 0.4
    with refused(SettingsError, "source.one_kinect"):
        kinect_v2.KinectV2Config.parse("1")


@pytest.mark.parametrize(
    ("module", "config"),
    [
        ("pyrealsense2", RealSenseConfig()),
        ("pyorbbecsdk", orbbec.OrbbecConfig()),
        ("primesense.openni2", openni.OpenNIConfig()),
        ("pykinect_azure", azure_kinect.AzureKinectConfig(bodies=True)),
        ("pykinect2.PyKinectV2", kinect_v2.KinectV2Config()),
    ],
)
def test_a_library_that_is_not_installed_is_told(monkeypatch, module, config) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with refused(NotAvailableError, "source.needs_module"):
        config.open()


def test_a_library_of_the_system_that_is_missing_is_told(monkeypatch, tmp_path) -> None:
    (tmp_path / "pyrealsense2.py").write_text(
        'raise ImportError("libusb-1.0.so.0: cannot open shared object file")'
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "pyrealsense2", raising=False)
    with refused(NotAvailableError, "source.module_broken"):
        RealSenseConfig().open()
