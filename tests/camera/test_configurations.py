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
from studio.camera.sources import registry
from studio.camera.sources.config import DeviceConfig, SourceConfig
from studio.camera.sources.recording import RecordingConfig
from studio.camera.sources.registry import SOURCES, Kind, add_source, open_source, parse_source, written
from studio.camera.sources.simulated import SimulatedConfig, SimulatedSource
from studio.camera.sources.simulated_depth import SimulatedDepthConfig
from studio.engine.base.errors import NotAvailableError, SettingsError
from studio.simulator.rig import MAX_CAMERAS

GOOD = {
    "simulated:0/2": SimulatedConfig(0, 2),
    "simulated:3/4:7": SimulatedConfig(3, 4, seed=7),
    "simulated-depth:1/2:3": SimulatedDepthConfig(1, 2, seed=3),
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
    f"webcam:{__file__}": WebcamConfig(__file__),
    f"webcam:{__file__}#1": WebcamConfig(__file__, number=1),
}

RIG = (
    f"allowed: {{kind}}:<index>/<count>[:<seed>] with a count from 1 to {MAX_CAMERAS} "
    "and an index from 0 to count - 1, such as {kind}:0/2"
)
NUMBER = "is not allowed; give the device's number, such as {kind}:0"
BAD = {
    "simulated": "source 'simulated:' is not allowed; " + RIG,
    "simulated:2/2": "source 'simulated:2/2' is not allowed; " + RIG,
    "simulated:0/9:5": "source 'simulated:0/9:5' is not allowed; " + RIG,
    "simulated:-1/2": "source 'simulated:-1/2' is not allowed; " + RIG,
    "simulated-depth:0/2:x": "source 'simulated-depth:0/2:x' is not allowed; " + RIG,
    "simulated-depth:0/0": "source 'simulated-depth:0/0' is not allowed; " + RIG,
    "recording:a?speed=fast": "speed 'fast' is not allowed; allowed: 1, max",
    "openni:x": "source openni:x " + NUMBER,
    "openni:100": "source openni:100 " + NUMBER,
    "openni:-1": "source openni:-1 " + NUMBER,
    f"openni:{'9' * 5000}": "source openni:9",
    "azure-kinect:x?bodies": "source azure-kinect:x " + NUMBER,
    "azure-kinect?bones": "source azure-kinect: 'bones' is not allowed; allowed: bodies",
    "kinect-v2:1": "source kinect-v2:1 is not allowed: the SDK opens one Kinect v2 for each computer",
    "kinect-v2?bones": "source kinect-v2: 'bones' is not allowed; allowed: bodies",
    "webcam": "source webcam:: no model file ''; get a pose landmarker (pose_landmarker_full.task) from",
    "webcam:/no/m.task#1": "source webcam:/no/m.task#1: no model file '/no/m.task'; get a pose landmarker",
    f"webcam:{__file__}#x": "source webcam:x " + NUMBER,
}

SDKS = (
    "pyrealsense2",
    "pyorbbecsdk",
    "primesense.openni2",
    "pykinect_azure",
    "pykinect2.PyKinectV2",
    "mediapipe",
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
    with pytest.raises(SettingsError) as error:
        parse_source(text)
    assert str(error.value).startswith(BAD[text].format(kind=kind_of(text)))


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
        lambda: WebcamConfig("missing.task"),
        lambda: WebcamConfig(__file__, number=-1),
    ],
)
def test_values_that_are_not_allowed_are_refused_like_texts(make):
    with pytest.raises(SettingsError, match=r"not allowed; |no model file"):
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
        if isinstance(config, DeviceConfig):
            with pytest.raises(NotAvailableError, match=rf"source {name} needs .*install"):
                config.open()
        else:
            assert name in ("simulated", "simulated-depth", "recording")


@dataclasses.dataclass(frozen=True)
class OwnConfig(SourceConfig):
    def open(self) -> SimulatedSource:
        return SimulatedSource(1, 2)


def test_an_own_kind_is_named_like_the_others(monkeypatch):
    monkeypatch.setattr(registry, "SOURCES", dict(SOURCES))
    add_source("my-camera", OwnConfig)
    assert written("my-camera") == "my-camera" and parse_source("my-camera") == OwnConfig()
    assert isinstance(open_source("my-camera"), SimulatedSource)
    with pytest.raises(
        SettingsError, match="OwnConfig: 'x' is not allowed; this kind of source has no argument"
    ):
        open_source("my-camera:x")
    with pytest.raises(SettingsError, match=r"unknown source .*, my-camera, such as"):
        open_source("magic")
    for name in ("my-camera", "simulated", "a:b", "a?b", ""):
        with pytest.raises(SettingsError, match=r"other than simulated, .*my-camera"):
            add_source(name, OwnConfig)
    assert registry.SOURCES["my-camera"] == Kind(OwnConfig) and "my-camera" not in SOURCES


def test_what_is_no_camera_is_refused():
    for wrong in (None, 7, SimulatedConfig):
        with pytest.raises(SettingsError, match="derived from Source or DepthSource"):
            open_source(wrong)
