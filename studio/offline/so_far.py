"""What a solve has so far, while its take is still tracked."""

from collections.abc import Callable
from dataclasses import dataclass

from studio.engine.model.poses import Poses


@dataclass(frozen=True)
class SoFar:
    """What a solve has so far, delivered part by part.

    Attributes:
        poses: the next part; the first one where `begins`.
        begins: earlier parts are replaced.
        until_s, of_s: length of all parts together, and of the whole [s].
    """

    poses: Poses
    begins: bool
    until_s: float
    of_s: float


Show = Callable[[SoFar], None]
