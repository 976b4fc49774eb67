"""The stage clock of the live stage: the reference camera's own clock, continued when that camera leaves.

Each camera's clock maps to the server's by its exchanges (`engine.solve.timing.clock`). They do not show the latency
of a device from the light to the time stamp. This constant per camera is its latency correction, which a calibration
by motion finds. The reference camera has none.
"""

from dataclasses import dataclass

from studio.engine.model.frames import ClockModel
from studio.engine.solve.timing.clock import chain, invert, shifted

MAX_CORRECTION_NS = 300_000_000
"""A larger latency correction is an error of the calibration and is not used."""


@dataclass(frozen=True)
class Anchor:
    """The camera whose clock is the stage clock; a client that restarted, or whose clock jumped, has another."""

    camera: str
    clock_id: str


class StageClock:
    """Maps cameras' clocks and the server's to the stage clock."""

    def __init__(self) -> None:
        self.anchor: Anchor | None = None
        self._corrections: dict[str, int] = {}
        self._common_to_stage: ClockModel | None = None

    def is_anchor(self, camera: str, clock_id: str) -> bool:
        return self.anchor == Anchor(camera, clock_id)

    def set_anchor(self, camera: str, clock_id: str) -> None:
        """Make this camera's clock the stage clock."""
        self.anchor = Anchor(camera, clock_id)
        self._common_to_stage = None

    def set_corrections(self, corrections_ns: dict[str, int]) -> None:
        """Use these latency corrections [ns] from now on; other cameras have none."""
        self._corrections = {k: v for k, v in corrections_ns.items() if abs(v) <= MAX_CORRECTION_NS}

    def correction_ns(self, camera: str) -> int:
        """Latency correction of the camera's frames: added to their stage time by exchanges [ns]."""
        anchor = 0 if self.anchor is None else self._corrections.get(self.anchor.camera, 0)
        return self._corrections.get(camera, 0) - anchor

    def restore(self, anchor: Anchor, server_to_stage: ClockModel) -> None:
        """Restore the stage clock from before a restart of the server."""
        self.anchor = anchor
        self._common_to_stage = server_to_stage

    @property
    def server_to_stage(self) -> ClockModel | None:
        """The map from the server's clock to the stage clock; None while the stage has no clock yet."""
        return self._common_to_stage

    def follow(self, device_to_server: ClockModel) -> None:
        """Use the newest clock of the anchor; while the anchor is away, the last one stays in use."""
        assert self.anchor is not None
        correction = self._corrections.get(self.anchor.camera, 0)
        self._common_to_stage = invert(shifted(device_to_server, correction))

    def camera_to_stage(self, camera: str, clock_id: str, device_to_server: ClockModel) -> ClockModel | None:
        """Return the clock model of a camera's frames; None while the stage has no clock yet."""
        if self.is_anchor(camera, clock_id):
            return ClockModel()
        if self._common_to_stage is None:
            return None
        common = shifted(device_to_server, self._corrections.get(camera, 0))
        return chain(common, self._common_to_stage)

    def server_to_stage_ns(self, server_ns: int) -> int | None:
        """Return the stage time of a server time [ns]; None while the stage has no clock yet."""
        return None if self._common_to_stage is None else self._common_to_stage.stage_ns(server_ns)
