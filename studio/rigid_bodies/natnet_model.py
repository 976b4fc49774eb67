"""Names of a NatNet server's assets: of rigid bodies, and of the markers on them and on performers.

Source: OptiTrack's public documentation, "Data descriptions": marker sets (0), rigid bodies (1), skeletons (2) and
trained marker sets (6, from 4.1 on). A labelled marker has the number of its asset and its own number, from 1. Its
name is in the description of a rigid body from 4.0 on, and in the marker set with the asset's name.
"""

from dataclasses import dataclass, field

from studio.engine.rigid_bodies.known import MOST_BODIES
from studio.engine.rigid_bodies.markers import MOST_MARKERS
from studio.rigid_bodies.packets import Packet

SIZED = (4, 1)
"""First version in which each part has its size in bytes."""

LONGEST_NAME = 64
_SET, _BODY, _SKELETON, _TRAINED = 0, 1, 2, 6


@dataclass
class NatNetModel:
    """The names of a server's assets.

    Attributes:
        bodies: names of rigid bodies, by number.
        assets: names of all assets with markers, by number; of two with the same number, the first.
        markers: names of each asset's markers in order, by number of the asset.
    """

    bodies: dict[int, str] = field(default_factory=dict)
    assets: dict[int, str] = field(default_factory=dict)
    markers: dict[int, list[str]] = field(default_factory=dict)

    def marker(self, asset: int, number: int) -> str:
        """Return the name of an asset's marker, such as `Anna:LKNE`; numbers replace unknown names."""
        name = self.assets.get(asset, f"asset {asset}")
        mine = self.markers.get(asset, [])
        own = mine[number - 1] if 1 <= number <= len(mine) else ""
        return f"{name}:{own or number}"


def read_model(packet: Packet, version: tuple[int, int]) -> NatNetModel:
    """Return the names in a packet of descriptions.

    Raises:
        CutError: it ends too early.
    """
    model, sets = NatNetModel(), dict[str, list[str]]()
    for _ in range(packet.count()):
        kind, part = packet.whole(), packet
        sized = version >= SIZED
        if sized:
            part = packet.part(packet.whole())  # additions of later versions at its end are skipped
        if kind == _SET:
            name = _name(part)
            sets.setdefault(name, _names(part))
        elif kind == _BODY:
            number, name, markers = _rigid_body(part, version)
            if len(model.bodies) < MOST_BODIES:
                model.bodies[number] = name or f"body {number}"
                _add(model, number, name or f"body {number}", markers)
        elif kind == _SKELETON:
            name, number = _name(part), part.whole()
            for _ in range(part.count()):
                _rigid_body(part, version)
            _add(model, number, name, [])
        elif kind == _TRAINED and sized:
            _add(model, *_trained(part, version))
        elif not sized:
            break  # plates, devices and cameras come last
    for number, name in model.assets.items():
        if not any(model.markers[number]):
            model.markers[number] = [_own(name, one) for one in sets.get(name, [])]
    return model


def _add(model: NatNetModel, number: int, name: str, markers: list[str]) -> None:
    if number not in model.assets and len(model.assets) < MOST_BODIES:
        model.assets[number], model.markers[number] = name, [_own(name, one) for one in markers]


def _own(asset: str, marker: str) -> str:
    """Return a marker's name without the prefix of its asset."""
    return marker.removeprefix(asset).lstrip(":_ ") or marker


def _name(packet: Packet) -> str:
    text = packet.text()[:LONGEST_NAME]
    return "".join(one if one.isprintable() else "?" for one in text)


def _names(packet: Packet) -> list[str]:
    return [_name(packet) for _ in range(packet.count())][:MOST_MARKERS]


def _rigid_body(packet: Packet, version: tuple[int, int]) -> tuple[int, str, list[str]]:
    """Return a rigid body's number, its name, and the names of its markers; without names before 4.0."""
    name, number = _name(packet), packet.whole()
    packet.skip(4 + 12 + (16 if version >= (4, 2) else 0))  # parent, offset, rotation
    markers = packet.count()
    packet.skip(16 * markers)  # places, labels
    named = [_name(packet) for _ in range(markers)] if version >= (4, 0) else []
    return number, name, named[:MOST_MARKERS]


def _trained(packet: Packet, version: tuple[int, int]) -> tuple[int, str, list[str]]:
    """Return a trained marker set's number, its name, and the names of its markers by their numbers from 1."""
    name = _name(packet)
    packet.skip(4)  # its kind
    number = packet.whole()
    for _ in range(packet.count()):
        _rigid_body(packet, version)
    named: dict[int, str] = {}
    for _ in range(packet.count()):
        own, member = _name(packet), packet.whole()
        packet.skip(12 + 4 + 2)  # place, size, flags
        if 1 <= member <= MOST_MARKERS:
            named[member] = own
    return number, name, [named.get(member, "") for member in range(1, max(named, default=0) + 1)]
