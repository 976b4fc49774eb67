"""Contact shadows: dark spots on the floor under heels and balls of the feet, the smaller the higher these are."""

import json
import struct

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.soles import rest_lift_m

Array = NDArray[np.float64]

_JOINTS = ("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")
_INDICES = [OUTPUT_INDEX[name] for name in _JOINTS]
_LIFTED_M = 0.12
"""Height from which a lifted foot has no contact shadow [m]."""

_SIZE_M = 0.105
_OVER_FLOOR_M = 0.003
_DARKEST = 0.5
_RINGS, _SECTORS = 10, 32
_STEP = 0.01
_FLOAT, _SHORT, _VERTICES, _INDEX = 5126, 5123, 34962, 34963


def spot() -> bytes:
    """Return a soft black disc of radius 1 in the plane z = 0 as a GLB.

    A blended mesh writes no depth, so that it hides nothing of the floor.
    """
    away = np.concatenate([[0.0], np.repeat(np.arange(1, _RINGS + 1) / _RINGS, _SECTORS)])
    turn = np.concatenate([[0.0], np.tile(2 * np.pi * np.arange(_SECTORS) / _SECTORS, _RINGS)])
    points = np.stack([away * np.cos(turn), away * np.sin(turn), 0.0 * away], axis=1).astype("<f4")
    colours = np.zeros((len(points), 4), dtype="<f4")
    colours[:, 3] = _DARKEST * (1.0 - away**2) ** 2
    one, other = np.arange(_SECTORS), (np.arange(_SECTORS) + 1) % _SECTORS
    faces = [np.stack([0 * one, 1 + one, 1 + other], axis=1)]
    for ring in range(_RINGS - 1):
        a, b, c, d = (1 + (ring + k) * _SECTORS + sector for k in (0, 1) for sector in (one, other))
        faces += [np.stack([a, c, d], axis=1), np.stack([a, d, b], axis=1)]
    return _glb(points, colours, np.concatenate(faces).astype("<u2"))


def _glb(points: NDArray[np.float32], colours: NDArray[np.float32], faces: NDArray[np.uint16]) -> bytes:
    """Return an unlit, blended mesh as a GLB."""
    arrays = (
        (points, _FLOAT, "VEC3", _VERTICES),
        (colours, _FLOAT, "VEC4", _VERTICES),
        (faces.ravel(), _SHORT, "SCALAR", _INDEX),
    )
    views, accessors, data = [], [], b""
    for values, kind, shape, target in arrays:
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes, "target": target})
        accessors.append(
            {"bufferView": len(accessors), "componentType": kind, "count": len(values), "type": shape}
        )
        data += values.tobytes()
    accessors[0] |= {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
    data += bytes(-len(data) % 4)
    head = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "extensionsUsed": ["KHR_materials_unlit"],
        "materials": [{"alphaMode": "BLEND", "doubleSided": True, "extensions": {"KHR_materials_unlit": {}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "material": 0}]}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def sizes(lifts_m: Array) -> Array:
    """Return the spots' sizes, 0 to 1, of joints lifted by `lifts_m` off the floor [m]."""
    share = np.clip(1.0 - lifts_m / _LIFTED_M, 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


class ContactShadows:
    """The spots of one performer."""

    def __init__(self, server: viser.ViserServer, name: str) -> None:
        self._standing_m: Array = np.zeros(len(_JOINTS))
        disc = spot()
        self._spots = [
            server.scene.add_glb(
                f"{name}/{joint}", disc, cast_shadow=False, receive_shadow=False, visible=False
            )
            for joint in _JOINTS
        ]

    def fit(self, rest_m: Array, root_height_m: float | None) -> None:
        """Take in the T-pose of a body, hips at 0 [m], shape (52, 3), for its joints' heights when it stands."""
        self._standing_m = rest_m[_INDICES, 2] + rest_lift_m(rest_m[:, 2], root_height_m)

    def draw(self, positions_m: Array) -> None:
        """Show a pose of the output skeleton [m], shape (52, 3)."""
        places = positions_m[_INDICES]
        shares = sizes(places[:, 2] - self._standing_m)
        for disc, place, share in zip(self._spots, places, shares, strict=True):
            disc.visible = bool(share > _STEP)
            if disc.visible:
                disc.position = (float(place[0]), float(place[1]), _OVER_FLOOR_M)
                disc.scale = _SIZE_M * round(float(share) / _STEP) * _STEP
