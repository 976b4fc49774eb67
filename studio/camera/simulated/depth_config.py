"""Configuration of a simulated depth camera; a search loads it alone, because the simulation is slow to load."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from studio.camera.simulated.rig_config import RigCameraConfig
from studio.camera.sources.config import FoundDevice
from studio.engine.base.sentences import say

if TYPE_CHECKING:
    from studio.camera.simulated.depth import SimulatedDepthSource

_FOUND = 2


@dataclass(frozen=True)
class SimulatedDepthConfig(RigCameraConfig):
    """A simulated camera of depth images, `simulated-depth:<index>/<count>[:<seed>]`."""

    kind = "simulated-depth"

    @classmethod
    def find(cls) -> list[FoundDevice]:
        """Return two simulated cameras, which are always there, to try the studio out."""
        return [FoundDevice(f"{cls.kind}:{k}/{_FOUND}", _named(k), f"simulated_{k}") for k in range(_FOUND)]

    def open(self) -> "SimulatedDepthSource":
        from studio.camera.simulated.depth import SimulatedDepthSource

        return SimulatedDepthSource(self.index, self.count, seed=self.seed)


def _named(index: int) -> str:
    return say("device.simulated_depth", "simulated depth camera {number}", number=index + 1)
