"""What a solve has so far, while its take is still tracked."""

from collections.abc import Callable
from dataclasses import dataclass

from studio.engine.model.poses import Poses


@dataclass(frozen=True)
class SoFar:
    """What a solve has so far, told part by part.

    Attributes:
        poses: the next part; the first one where `begins`.
        begins: what was told before is replaced.
        until_s, of_s: length of all parts together, and of the whole [s].
    """

    poses: Poses
    begins: bool
    until_s: float
    of_s: float


Show = Callable[[SoFar], None]
