"""Trackers over OSC, in the formats of VMC and of VRChat; SlimeVR sends both.

VMC: `/VMC/Ext/Tra/Pos`, `/VMC/Ext/Hmd/Pos`, `/VMC/Ext/Con/Pos` serial, position [m], rotation x y z w.
VRChat: `/tracking/trackers/<1 to 8 or head>/position` x y z [m], and `/rotation` x y z [degrees], about z, then x,
then y. Both have Unity's axes. Sources: protocol.vmc.info, VRChat's "OSC Trackers", Open Sound Control 1.0.
"""

import math
from collections.abc import Sequence

import numpy as np

from studio.engine.base.quaternions import multiply
from studio.engine.rigid_bodies.known import MOST_BODIES
from studio.engine.rigid_bodies.reading import BodyReading
from studio.rigid_bodies.natnet import is_pose
from studio.wire.osc import NotOscError, OscMessage, osc_messages

PORT = 39540
LONGEST = 8192
_VMC = {"/VMC/Ext/Tra/Pos": "tracker", "/VMC/Ext/Hmd/Pos": "headset", "/VMC/Ext/Con/Pos": "controller"}
_VRCHAT = "/tracking/trackers/"
_LONGEST_NAME = 64
_PLACES = (*(str(number) for number in range(1, 9)), "head")
_Turn = tuple[float, float, float, float]


class TrackerDecoder:
    """Finds trackers in OSC packets. VRChat sends a tracker's rotation in its own message; the last one counts.

    Attributes:
        refused: number of packets that were no OSC, or had no address of VMC or of a VRChat tracker.
    """

    def __init__(self) -> None:
        self.refused = 0
        self._turns: dict[str, _Turn] = {}
        self._names: set[str] = set()

    def feed(self, data: bytes) -> list[BodyReading]:
        """Return the trackers of a packet, if any."""
        if not data or len(data) > LONGEST or len(data) % 4:
            self.refused += 1
            return []
        try:
            messages = osc_messages(data)
        except NotOscError:
            self.refused += 1
            return []
        for message in messages:
            if message.address.endswith("/rotation"):
                self._turn(message)
        found = [one for one in map(self._reading, messages) if one is not None]
        self.refused += not found and not any(_is_tracker(message.address) for message in messages)
        return found

    def _turn(self, message: OscMessage) -> None:
        name = _vrchat_name(message.address, "rotation")
        angles = _numbers(message.arguments)
        if name and len(angles) == 3 and all(abs(one) <= 36_000 for one in angles):
            self._turns[name] = unity_euler_xyzw(*angles)

    def _reading(self, message: OscMessage) -> BodyReading | None:
        if message.address in _VMC and len(message.arguments) == 8 and isinstance(message.arguments[0], str):
            name = message.arguments[0][:_LONGEST_NAME].strip() or _VMC[message.address]
            numbers = _numbers(message.arguments[1:])
        else:
            name = _vrchat_name(message.address, "position")
            numbers = _numbers(message.arguments)
            if len(numbers) == 3:
                numbers += self._turns.get(name, (0.0, 0.0, 0.0, 1.0))
        if not name or not name.isprintable() or not is_pose(numbers):
            return None
        if name not in self._names and len(self._names) >= MOST_BODIES:
            return None
        self._names.add(name)
        x, y, z, qx, qy, qz, qw = numbers
        return BodyReading(name, (x, y, z), (qx, qy, qz, qw))


def _is_tracker(address: str) -> bool:
    return address in _VMC or address.startswith(("/VMC/", _VRCHAT))


def _vrchat_name(address: str, what: str) -> str:
    place = address.removeprefix(_VRCHAT).removesuffix("/" + what)
    known = address == f"{_VRCHAT}{place}/{what}" and place in _PLACES
    return f"tracker {place}" if known else ""


def _numbers(params: Sequence[object]) -> list[float]:
    """Return arguments as numbers; none if any is no number."""
    numbers = [float(one) for one in params if isinstance(one, float)]
    return numbers if len(numbers) == len(params) and all(map(math.isfinite, numbers)) else []


def unity_euler_xyzw(x_deg: float, y_deg: float, z_deg: float) -> _Turn:
    """Return Unity's angles as a quaternion x, y, z, w: rotated about z first, then about x, then about y."""
    about = [np.zeros(4) for _ in range(3)]
    for axis, angle_deg in enumerate((x_deg, y_deg, z_deg)):
        half = math.radians(angle_deg) / 2
        about[axis][0], about[axis][1 + axis] = math.cos(half), math.sin(half)
    w, x, y, z = multiply(multiply(about[1], about[0]), about[2]).tolist()
    return x, y, z, w
