"""Every kind of camera's configuration: what it takes, as text and as values, and what it opens."""

import dataclasses
import sys

import pytest

import studio
from studio.camera.devices.azure_kinect import AzureKinectConfig
from studio.camera.devices.kinect_v2 import KinectV2Config
from studio.camera.devices.openni import OpenNIConfig
from studio.camera.devices.orbbec import OrbbecConfig
from studio.camera.devices.realsense import RealSenseConfig
from studio.camera.devices.webcam import WebcamConfig
from studio.camera.simulated.depth_config import SimulatedDepthConfig
from studio.camera.simulated.landmarks import SimulatedRgbConfig
from studio.camera.simulated.skeletons import SimulatedConfig, SimulatedSource
from studio.camera.sources import registry
from studio.camera.sources.config import DeviceConfig, SourceConfig
from studio.camera.sources.recording import RecordingConfig
from studio.camera.sources.registry import SOURCES, Kind, add_source, open_source, parse_source, written
from studio.camera.sources.video import VideoConfig
from studio.engine.base.errors import NotAvailableError, SettingsError
from tests.refused import refused

GOOD = {
    "simulated:0/2": SimulatedConfig(0, 2),
    "simulated:3/4:7": SimulatedConfig(3, 4, seed=7),
    "simulated-depth:1/2:3": SimulatedDepthConfig(1, 2, seed=3),
    "simulated-rgb:1/2:3": SimulatedRgbConfig(1, 2, seed=3),
    "recording:takes/walk": RecordingConfig("takes/walk"),
    "recording:a.mkv?speed=": RecordingConfig("a.mkv"),
    "recording:takes/walk#left?speed=max": RecordingConfig("takes/walk", camera="left", speed="max"),
    "recording:C:\\takes\\walk#left": RecordingConfig("C:\\takes\\walk", camera="left"),
    "realsense": RealSenseConfig(),
    "realsense:": RealSenseConfig(),
    "realsense:A1": RealSenseConfig(serial="A1"),
    "orbbec": OrbbecConfig(),
    "orbbec:7": OrbbecConfig(serial="7"),
    "openni": OpenNIConfig(),
    "openni:1": OpenNIConfig(number=1),
    "azure-kinect": AzureKinectConfig(),
    "azure-kinect:1?bodies": AzureKinectConfig(number=1, bodies=True),
    "azure-kinect?bodies": AzureKinectConfig(bodies=True),
    "kinect-v2": KinectV2Config(),
    "kinect-v2:0": KinectV2Config(),
    "kinect-v2?bodies": KinectV2Config(bodies=True),
    "webcam": WebcamConfig(),
    "webcam:1": WebcamConfig(1),
    "webcam?mirrored": WebcamConfig(mirrored=True),
    "webcam:1?model=lite&mirrored": WebcamConfig(1, model="lite", mirrored=True),
    "webcam?no-hands": WebcamConfig(hands=False),
    "video:shoot/a.mp4": VideoConfig("shoot/a.mp4"),
    "video:C:\\shoot\\a #1.mp4?speed=max&model=lite": VideoConfig(
        "C:\\shoot\\a #1.mp4", speed="max", model="lite"
    ),
}

BAD = {
    "simulated": "source.rig",
    "simulated:2/2": "source.rig",
    "simulated:0/9:5": "source.rig",
    "simulated:-1/2": "source.rig",
    "simulated-depth:0/2:x": "source.rig",
    "simulated-depth:0/0": "source.rig",
    "simulated-rgb:2/2": "source.rig",
    "recording:a?speed=fast": "value.bad",
    "openni:x": "source.number",
    "openni:100": "source.number",
    "openni:-1": "source.number",
    f"openni:{'9' * 5000}": "source.number",
    "azure-kinect:x?bodies": "source.number",
    "azure-kinect?bones": "source.flag",
    "kinect-v2:1": "source.one_kinect",
    "kinect-v2?bones": "source.flag",
    "webcam:x": "source.number",
    "webcam:-1": "source.number",
    "webcam?colour": "value.bad",
    "webcam?speed=max": "value.bad",
    "webcam?model=missing.task": "value.unknown",
    "video:": "value.bad",
    "video:a.mp4?speed=fast": "value.bad",
}

SDKS = (
    "pyrealsense2",
    "pyorbbecsdk",
    "primesense.openni2",
    "pykinect_azure",
    "pykinect2.PyKinectV2",
)


def kind_of(text: str) -> str:
    return text.partition(":")[0].partition("?")[0]


def test_every_kind_is_tried_here():
    for texts in (GOOD, {**BAD, "realsense": "", "orbbec": ""}):  # a serial number is any text
        assert {kind_of(text) for text in texts} == set(SOURCES)
    assert {kind.config().__name__ for kind in SOURCES.values()} <= set(studio.__all__)


@pytest.mark.parametrize("text", GOOD)
def test_a_text_is_a_configuration(text):
    config = parse_source(text)
    assert config == GOOD[text] and type(config) is type(GOOD[text]) and hash(config) == hash(GOOD[text])


@pytest.mark.parametrize("text", BAD)
def test_a_text_that_is_not_allowed_says_what_is(text):
    with refused(SettingsError, BAD[text]):
        parse_source(text)


@pytest.mark.parametrize(
    "make",
    [
        lambda: SimulatedConfig(2, 2),
        lambda: SimulatedConfig(-1, 2),
        lambda: SimulatedConfig(0, 2, seed=-1),
        lambda: SimulatedDepthConfig(0, 9),
        lambda: RecordingConfig("takes/walk", speed="2"),
        lambda: OpenNIConfig(-1),
        lambda: AzureKinectConfig(100),
        lambda: WebcamConfig(model="missing.task"),
        lambda: WebcamConfig(-1),
        lambda: VideoConfig(""),
    ],
)
def test_values_that_are_not_allowed_are_refused_like_texts(make):
    with refused(SettingsError, "value.bad", "value.unknown", "source.rig", "source.number"):
        make()


@pytest.mark.parametrize("config", GOOD.values(), ids=str)
def test_a_configuration_cannot_be_changed(config):
    field = dataclasses.fields(config)[0].name
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(config, field, None)


@pytest.mark.parametrize("name", SOURCES)
def test_a_device_needs_its_library_only_to_be_opened(name, monkeypatch):
    for module in SDKS:
        monkeypatch.setitem(sys.modules, module, None)
    for text, config in GOOD.items():
        if kind_of(text) != name:
            continue
        if isinstance(config, DeviceConfig) and name != "webcam":
            with refused(NotAvailableError, "source.needs_module", kind=name):
                config.open()
        else:
            assert name in ("simulated", "simulated-depth", "simulated-rgb", "recording", "webcam", "video")


@dataclasses.dataclass(frozen=True)
class OwnConfig(SourceConfig):
    def open(self) -> SimulatedSource:
        return SimulatedSource(1, 2)


def test_an_own_kind_is_named_like_the_others(monkeypatch):
    monkeypatch.setattr(registry, "SOURCES", dict(SOURCES))
    add_source("my-camera", OwnConfig)
    assert written("my-camera") == "my-camera" and parse_source("my-camera") == OwnConfig()
    assert isinstance(open_source("my-camera"), SimulatedSource)
    with refused(SettingsError, "source.no_argument", kind="OwnConfig", text="x"):
        open_source("my-camera:x")
    with refused(SettingsError, "value.unknown", kind="source"):
        open_source("magic")
    for name in ("my-camera", "simulated", "a:b", "a?b", ""):
        with refused(SettingsError, "value.bad"):
            add_source(name, OwnConfig)
    assert registry.SOURCES["my-camera"] == Kind(OwnConfig) and "my-camera" not in SOURCES


def test_what_is_no_camera_is_refused():
    for wrong in (None, 7, SimulatedConfig):
        with refused(SettingsError, "source.not_a_source"):
            open_source(wrong)
