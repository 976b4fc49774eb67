"""Options of sources of pictures in the text of `--source`: `?model=lite&mirrored`."""

from abc import abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from studio.camera.sources.config import SourceConfig
from studio.engine.base.errors import SettingsError
from studio.engine.base.value_sentences import bad_value
from studio.engine.seeing.pictures.bundle import model_file

_FLAGS = ("model=lite|full|heavy|FILE", "mirrored", "no-hands")


@dataclass(frozen=True, kw_only=True)
class PictureConfig(SourceConfig):
    """Options of all sources of pictures.

    Attributes:
        model: `lite`, `full`, `heavy`, or the path of a bundle (`.task`).
        mirrored: the camera swaps left and right, as selfie cameras do.
        hands: look for the hands too; `no-hands` in a text turns this off.

    Raises:
        SettingsError, NotAvailableError: there is no such model.
    """

    model: str | Path = "full"
    mirrored: bool = False
    hands: bool = True

    def __post_init__(self) -> None:
        model_file(self.model)

    @classmethod
    def parse(cls, text: str) -> Self:
        text, _, rest = text.partition("?")
        options: dict[str, str | bool] = {}
        for part in filter(None, rest.split("&")):
            name, equals, value = part.partition("=")
            if name in cls.texts() and equals:
                options[name] = value
            elif part == "mirrored":
                options[name] = True
            elif part == "no-hands":
                options["hands"] = False
            else:
                raise SettingsError(bad_value("source", repr(part), [*_FLAGS, *cls.texts()[1:]]))
        return cls.of(text, **options)

    @classmethod
    def texts(cls) -> tuple[str, ...]:
        """Return the options with a value."""
        return ("model",)

    @classmethod
    @abstractmethod
    def of(cls, text: str, **options: object) -> Self:
        """Return the configuration for the text before the options.

        Raises:
            SettingsError: this kind does not allow the text.
        """
