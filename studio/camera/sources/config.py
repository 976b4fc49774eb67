"""Configurations of the kinds of cameras: a frozen dataclass for each, beside its source."""

from abc import ABC, abstractmethod
from typing import Self

from studio.camera.sources.depth_source import DepthSource
from studio.camera.sources.source import Source
from studio.engine.base.errors import SettingsError


class SourceConfig(ABC):
    """The configuration of a kind of camera: a frozen dataclass that checks its values in `__post_init__`."""

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the configuration of the command line's `<kind>:<text>`; by default a kind has no argument.

        Raises:
            SettingsError: this kind does not allow the text.
        """
        if text:
            raise SettingsError(
                "source.no_argument",
                "{kind}: {text!r} is not allowed; this kind of source has no argument",
                kind=cls.__name__,
                text=text,
            )
        return cls()

    @abstractmethod
    def open(self) -> Source | DepthSource:
        """Return the camera; a device's library is imported only now.

        Raises:
            NotAvailableError: the device's library is not installed.
            StudioError: the device is missing, or the recording cannot be read.
        """


class DeviceConfig(SourceConfig):
    """The configuration of a device that may be unplugged; a client opens it again until it is back."""
