"""The result of a way of bringing videos to one clock."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.sentences import Said


@dataclass(frozen=True)
class VideoClock:
    """The clock of a video's pictures.

    Attributes:
        starts_s: time of the first one on the common clock [s].
        drift: how much faster the common clock runs than the video's, as a share.
        within_s: maximum error of the start [s]; None = unknown, and the start is not used.
    """

    starts_s: float = 0.0
    drift: float = 0.0
    within_s: float | None = None

    def of(self, times_ns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return times since the video's beginning [ns] on the common clock."""
        return times_ns + round(self.starts_s * 1e9) + np.round(times_ns * self.drift).astype(np.int64)


@dataclass
class ByClock:
    """The result of one way.

    Attributes:
        clocks: of the videos that it can place; fewer than two mean that it failed.
        problems: why others cannot be placed.
        notes: what else to report.
    """

    clocks: dict[str, VideoClock] = field(default_factory=dict)
    problems: list[Said] = field(default_factory=list)
    notes: list[Said] = field(default_factory=list)
