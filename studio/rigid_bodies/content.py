"""Content of another system's packet."""

from msgspec import Struct

from studio.engine.rigid_bodies.markers import MarkersReading
from studio.engine.rigid_bodies.reading import BodyReading


class PacketContent(Struct, frozen=True):
    """The rigid bodies and markers of an instant.

    Attributes:
        bodies: empty = none.
        markers: None = none.
    """

    bodies: list[BodyReading] = []
    markers: MarkersReading | None = None

    def __bool__(self) -> bool:
        return bool(self.bodies) or self.markers is not None
