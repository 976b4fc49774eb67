"""VMC (Virtual Motion Capture protocol): a frame as OSC bundles over UDP, for Unity, Unreal, Blender and VR.

Addresses and arguments are those of the protocol's performer: `/VMC/Ext/Bone/Pos` name, position, rotation xyzw in
the parent's axes; `/VMC/Ext/Root/Pos`; `/VMC/Ext/OK` and `/VMC/Ext/T`, which end a frame. Source: protocol.vmc.info.
"""

import numpy as np
from numpy.typing import NDArray
from pythonosc.osc_message_builder import OscMessageBuilder

from studio.engine.timecode.timecode import Timecode
from studio.streams.unity import UNITY_BONES, UnityPose

PORT = 39539
TIMECODE = "/studio/timecode"
MAX_DATAGRAM = 1400
"""Maximum size in bytes; Ethernet splits a larger datagram, which is lost if one part is."""

_BUNDLE = b"#bundle\0" + (1).to_bytes(8, "big")  # to be applied at once
_POSE_FLOATS = 7


def _message(address: str, *arguments: str | float | int) -> bytes:
    builder = OscMessageBuilder(address)
    for argument in arguments:
        builder.add_arg(argument)
    return builder.build().dgram


class VmcEncoder:
    """Makes the datagrams of a frame; their texts are made once, and each frame's numbers are inserted."""

    def __init__(self) -> None:
        zeros = (0.0,) * _POSE_FLOATS
        root = _message("/VMC/Ext/Root/Pos", "root", *zeros[:6], 1.0)
        bones = [_message("/VMC/Ext/Bone/Pos", name, *zeros) for name in UNITY_BONES]
        end = [_message("/VMC/Ext/OK", 1), _message("/VMC/Ext/T", 0.0)]
        self._datagrams: list[NDArray[np.uint32]] = []
        self._bones: list[tuple[int, NDArray[np.int64]]] = []
        datagram, places, first = _BUNDLE, [], 0
        for index, message in enumerate([root, *bones, *end]):
            if len(datagram) + 4 + len(message) > MAX_DATAGRAM:
                first = self._close(datagram, places, first)
                datagram, places = _BUNDLE, []
            datagram += len(message).to_bytes(4, "big") + message
            if 1 <= index <= len(bones):
                places.append(len(datagram) // 4 - _POSE_FLOATS)
        self._close(datagram, places, first)

    def _close(self, datagram: bytes, places: list[int], first: int) -> int:
        """Store a datagram as words, with the positions of its bones' numbers; return the next bone."""
        self._datagrams.append(np.frombuffer(datagram, dtype=">u4").copy())
        words = np.array(places, dtype=np.int64)[:, None] + np.arange(_POSE_FLOATS)
        self._bones.append((first, words.reshape(len(places), _POSE_FLOATS)))
        return first + len(places)

    def encode(self, pose: UnityPose, timecode: Timecode | None = None) -> list[bytes]:
        """Return the datagrams of a frame; the last one ends with its time [s].

        `timecode` goes first, in its own datagram: `/studio/timecode` text, rate. Receivers ignore unknown addresses.
        """
        values = np.concatenate([pose.local_positions_m, pose.local_rotations_wxyz[:, [1, 2, 3, 0]]], axis=1)
        words = values.astype(">f4").view(">u4")
        for datagram, (first, places) in zip(self._datagrams, self._bones, strict=True):
            datagram[places] = words[first : first + len(places)]
        self._datagrams[-1][-1:] = np.array([pose.time_s], dtype=">f4").view(">u4")
        told = [] if timecode is None else [_message(TIMECODE, str(timecode), timecode.rate.name)]
        return told + [datagram.tobytes() for datagram in self._datagrams]
