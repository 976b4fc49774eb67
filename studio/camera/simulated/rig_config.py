"""Configuration of simulated cameras: the camera of a standard rig, and the seed of its stage."""

import re
from dataclasses import dataclass
from typing import ClassVar, Self

from studio.camera.sources.config import SourceConfig
from studio.engine.base.errors import SettingsError
from studio.simulator.rig import MAX_CAMERAS


@dataclass(frozen=True)
class RigCameraConfig(SourceConfig):
    """`<index>/<count>[:<seed>]`: one camera of the standard rig.

    Attributes:
        index: which camera, from 0.
        count: how many cameras the rig has.
        seed: one for all cameras of a stage.

    Raises:
        SettingsError: a camera that the rig does not have.
    """

    kind: ClassVar[str]

    index: int
    count: int
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.index < self.count <= MAX_CAMERAS or self.seed < 0:
            raise self._refused(f"{self.index}/{self.count}" + (f":{self.seed}" if self.seed else ""))

    @classmethod
    def parse(cls, text: str) -> Self:
        match = re.fullmatch(r"(\d{1,3})/(\d{1,3})(?::(\d{1,18}))?", text)
        if match is None:
            raise cls._refused(text)
        return cls(int(match[1]), int(match[2]), int(match[3] or 0))

    @classmethod
    def _refused(cls, text: str) -> SettingsError:
        return SettingsError(
            "source.rig",
            "source '{kind}:{text}' is not allowed; allowed: {kind}:<index>/<count>[:<seed>] "
            "with a count from 1 to {most} and an index from 0 to count - 1, such as {kind}:0/2",
            kind=cls.kind,
            text=text,
            most=MAX_CAMERAS,
        )
