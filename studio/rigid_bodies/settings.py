"""Settings of incoming rigid bodies: `sessions/rigid_bodies.json`, so that they survive a restart."""

import ipaddress
from pathlib import Path
from typing import Any, Literal

import msgspec
from msgspec import Struct

from studio.engine.base.addresses import is_host
from studio.engine.base.choices import load_choices, save_choices
from studio.engine.base.versions import RIGID_BODIES
from studio.engine.rigid_bodies.known import BodyPlace, KnownBody, TakeBodies, Tie, bad_value, check_bodies
from studio.rigid_bodies.natnet import PORT as NATNET_PORT
from studio.rigid_bodies.trackers import PORT as OSC_PORT

FILE = "rigid_bodies.json"
_LATEST_S, _FARTHEST_M = 0.5, 2.0


class RigidSettings(Struct, frozen=True, forbid_unknown_fields=True):
    """The systems to listen to; all are off until they are switched on.

    Attributes:
        osc, natnet: whether trackers over OSC, and NatNet, are received.
        host, osc_port: address of this machine at which OSC is received; loopback keeps other machines out.
        natnet_server, natnet_port: machine on which Motive runs, and its port for commands.
        natnet_multicast: the group that Motive sends to, "" = it sends to this program alone (unicast).
        natnet_up: the axis that points up in Motive's data.
        place: placement of the other system on the stage.
        bodies: meaning of the rigid bodies.
        later_s: time added to the arrival of readings [s].
        ties: placement of bodies on their joints, by name, as measured in a take; bodies used as evidence pin joints.
    """

    osc: bool = False
    natnet: bool = False
    host: str = "127.0.0.1"
    osc_port: int = OSC_PORT
    natnet_server: str = "127.0.0.1"
    natnet_port: int = NATNET_PORT
    natnet_multicast: str = ""
    natnet_up: Literal["y", "z"] = "y"
    place: BodyPlace = BodyPlace()
    bodies: tuple[KnownBody, ...] = ()
    later_s: float = 0.0
    ties: dict[str, Tie] = {}

    def in_take(self) -> TakeBodies:
        """Return the facts about bodies for a take that is recorded now."""
        return TakeBodies(self.place, self.bodies, self.later_s, self.ties)

    def check(self) -> None:
        """Check the values.

        Raises:
            SettingsError: a value that is not allowed.
        """
        for name in ("osc_port", "natnet_port"):
            if not 1 <= getattr(self, name) <= 65_535:
                raise bad_value(name, getattr(self, name), "1 to 65535")
        for name in ("host", "natnet_server"):
            value = getattr(self, name)
            if not is_host(value):
                raise bad_value(name, value, "a machine's name or address, such as 127.0.0.1")
        if self.natnet_multicast and not _is_multicast(self.natnet_multicast):
            raise bad_value(
                "natnet_multicast", self.natnet_multicast, "none, or a group such as 239.255.42.99"
            )
        if not abs(self.later_s) <= _LATEST_S:
            raise bad_value("later_s", self.later_s, f"{-_LATEST_S:g} to {_LATEST_S:g}")
        for name, tie in self.ties.items():
            if not all(abs(one) <= _FARTHEST_M for one in tie.offset_m):
                raise bad_value("ties", name, f"offsets up to {_FARTHEST_M:g} m")
        check_bodies(self.bodies, self.place)


def _is_multicast(text: str) -> bool:
    try:
        return ipaddress.IPv4Address(text).is_multicast
    except ValueError:
        return False


def load_rigid_settings(sessions: Path) -> RigidSettings:
    """Return the stored settings; without a file all systems are off.

    Raises:
        SettingsError: the file cannot be read.
    """

    def read(value: dict[str, Any]) -> RigidSettings:
        settings = msgspec.convert(value, RigidSettings)
        settings.check()
        return settings

    return load_choices(sessions / FILE, RIGID_BODIES, read, RigidSettings())


def save_rigid_settings(sessions: Path, settings: RigidSettings) -> None:
    """Store the settings.

    Raises:
        StudioError: the file cannot be written.
    """
    save_choices(sessions / FILE, RIGID_BODIES, msgspec.to_builtins(settings))
