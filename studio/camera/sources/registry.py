"""The registry of sources of a camera client.

Errors of `open_source` list them; `studio camera --help` and docs/devices.md describe them. A source
of depth (`depth_source.DepthSource`) becomes one of skeletons through `tracked.TrackedSource`.
"""

import re
from dataclasses import dataclass
from importlib import import_module

from studio.camera.sources.config import DeviceConfig, SourceConfig
from studio.camera.sources.depth_source import DepthSource
from studio.camera.sources.source import Source
from studio.camera.sources.steady import steady
from studio.camera.sources.tracked import TrackedSource
from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_value, unknown


@dataclass(frozen=True)
class Kind:
    """A kind of source.

    Attributes:
        where: its configuration's class, or `<module>:<class>`, which is imported on demand.
        argument: form of the text after the colon; "" = none.
        found: its devices can be looked for, by its configuration's `find`.
    """

    where: str | type[SourceConfig]
    argument: str = ""
    found: bool = False

    def config(self) -> type[SourceConfig]:
        """Return the class of its configuration."""
        if not isinstance(self.where, str):
            return self.where
        module, _, name = self.where.partition(":")
        return getattr(import_module(module), name)


_SOURCES, _DEVICES = "studio.camera.sources", "studio.camera.devices"
_SIMULATED = "studio.camera.simulated"

SOURCES: dict[str, Kind] = {
    "simulated": Kind(
        f"{_SIMULATED}.skeletons:SimulatedConfig", "<index>/<count>[:<seed>[:<performers>[:<begin>]]]"
    ),
    "simulated-depth": Kind(
        f"{_SIMULATED}.depth_config:SimulatedDepthConfig", "<index>/<count>[:<seed>]", found=True
    ),
    "simulated-rgb": Kind(f"{_SIMULATED}.landmarks:SimulatedRgbConfig", "<index>/<count>[:<seed>]"),
    "recording": Kind(f"{_SOURCES}.recording:RecordingConfig", "<path>[#<camera>][?speed=max]"),
    "realsense": Kind(f"{_DEVICES}.realsense:RealSenseConfig", "[<serial>]", found=True),
    "orbbec": Kind(f"{_DEVICES}.orbbec:OrbbecConfig", "[<serial>]", found=True),
    "openni": Kind(f"{_DEVICES}.openni:OpenNIConfig", "[<number>]", found=True),
    "azure-kinect": Kind(f"{_DEVICES}.azure_kinect:AzureKinectConfig", "[<number>][?bodies]", found=True),
    "kinect-v2": Kind(f"{_DEVICES}.kinect_v2:KinectV2Config", "[?bodies]", found=True),
    "webcam": Kind(
        f"{_DEVICES}.webcam:WebcamConfig", "[<number>][?model=<model>][&mirrored][&no-hands]", found=True
    ),
    "video": Kind(
        f"{_SOURCES}.video:VideoConfig", "<path>[?speed=max][&model=<model>][&mirrored][&no-hands]"
    ),
}
"""The kinds of sources by name, `<kind>[:<argument>]`."""


def add_source(name: str, config: type[SourceConfig], argument: str = "") -> None:
    """Register a kind of source in this process, for `<name>[:<argument>]`.

    Args:
        name: letters, digits, `_` and `-`.
        config: its configuration, a frozen dataclass.
        argument: form of the text after the colon, for people; "" = none.

    Raises:
        SettingsError: the name is taken or is not allowed.
    """
    if name in SOURCES or not re.fullmatch(r"[A-Za-z0-9_-]+", name):
        raise SettingsError(
            bad_value(
                "source", repr(name), f"a name of letters, digits, `_`, `-` other than {', '.join(SOURCES)}"
            )
        )
    SOURCES[name] = Kind(config, argument)


def parse_source(text: str) -> SourceConfig:
    """Return the configuration of a text `<kind>[:<argument>]`.

    Raises:
        SettingsError: an unknown kind, or an argument that its kind does not allow.
    """
    name, _, argument = text.partition(":")
    if "?" in name:  # a flag without a device, such as kinect-v2?bodies
        name, _, flags = name.partition("?")
        argument = f"?{flags}"
    if name not in SOURCES:
        allowed = ", ".join(written(name) for name in SOURCES)
        raise SettingsError(unknown("source", text, f"{allowed}, such as simulated:0/2"))
    return SOURCES[name].config().parse(argument)


def open_source(source: str | SourceConfig | Source | DepthSource, *, keep_depth: bool = False) -> Source:
    """Return a source for a client: a lost device is opened again, and depth becomes skeletons.

    Args:
        source: a text, see `SOURCES`, a configuration, or an open camera.
        keep_depth: frames made from depth include their image.

    Raises:
        SettingsError: an unknown kind, or an argument that its kind does not allow.
        NotAvailableError: the device's library is not installed.
        StudioError: the device is missing.
        FormatError, TakeError: a recording that cannot be read.
    """
    config = parse_source(source) if isinstance(source, str) else source
    if isinstance(config, SourceConfig):
        opened = steady(config.open) if isinstance(config, DeviceConfig) else config.open()
    else:
        opened = config
    if isinstance(opened, DepthSource):
        return TrackedSource(opened, keep_depth=keep_depth)
    if not isinstance(opened, Source):
        raise SettingsError(
            "source.not_a_source",
            "source {source!r} is not allowed; give a text such as simulated:0/2, a "
            "configuration, or a camera derived from Source or DepthSource",
            source=source,
        )
    if isinstance(opened, TrackedSource) and keep_depth:
        opened.keep_depth = True
    return opened


def written(name: str) -> str:
    """Return the written form of a kind of source, such as `simulated:<index>/<count>[:<seed>]`."""
    argument = SOURCES[name].argument
    if not argument.startswith("["):
        return f"{name}:{argument}" if argument else name
    return f"{name}[:{argument[1:]}" if argument.startswith("[<") else f"{name}{argument}"
