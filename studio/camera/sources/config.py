"""Configurations of the kinds of cameras: a frozen dataclass for each, next to its source."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from studio.camera.sources.depth_source import DepthSource
from studio.camera.sources.picture import picture_of
from studio.camera.sources.source import Source
from studio.engine.base.errors import SettingsError


@dataclass(frozen=True)
class FoundDevice:
    """A device that is plugged into this machine, found without opening it.

    Attributes:
        source: text of `--source` that opens it; only its kind if something is missing.
        device: what it is, for people.
        name: a name for its camera, the same at every search.
        serial: its serial number; "" = unknown.
        needs: what is missing to open it, and what to do; "" = nothing.
    """

    source: str
    device: str
    name: str
    serial: str = ""
    needs: str = ""


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

    @classmethod
    def find(cls) -> list[FoundDevice]:
        """Return the devices of this kind that are plugged in, without opening one; by default a kind has none.

        `studio.camera.finding` calls it in a process of its own, since a device's library may hang or crash.

        Raises:
            StudioError: they cannot be looked for, such as without the device's library.
        """
        return []

    def picture(self) -> NDArray[np.uint8]:
        """Open the camera and return an image: grey, shape (height, width), or RGB, shape (height, width, 3).

        Raises:
            NotAvailableError: the camera gives no images, or its library is not installed.
            StudioError: it cannot be opened, or gives no image.
        """
        return picture_of(self.open())

    @abstractmethod
    def open(self) -> Source | DepthSource:
        """Return the camera; a device's library is imported only now.

        Raises:
            NotAvailableError: the device's library is not installed.
            StudioError: the device is missing, or the recording cannot be read.
        """


class DeviceConfig(SourceConfig):
    """The configuration of a device that may be unplugged; a client opens it again until it is back."""
