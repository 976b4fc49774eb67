"""Laboratory markers on the mannequin: the full-body Plug-in Gait set.

A marker lies where a ray from inside the body leaves the skin, and follows one joint, as a marker on a person
follows the bone below it. Names and places: Vicon, "Plug-in Gait Reference Guide", full-body marker placement.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.mannequin.mesh import SkinnedMesh
from studio.engine.animation.mannequin.rig import MannequinRig
from studio.engine.base.errors import FormatError
from studio.engine.model.joints import OUTPUT_PARENT

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

MARKER_RADIUS_M = 0.007
"""Distance of a marker's centre from the skin, for markers of 14 mm."""


class Place(NamedTuple):
    """A starting point in the body and a direction.

    Attributes:
        role: the joint that the marker follows; `{s}` stands for the side.
        start, end, share: the ray starts between these two joints, at this share of the way.
        shift: added to that point [m at a stature of 1.75 m; x outwards, y up, z forward].
        way: direction of the ray (x outwards, y up, z forward).
    """

    role: str
    start: str
    end: str
    share: float
    shift: Triple
    way: Triple


_SIDED: dict[str, Place] = {
    "FHD": Place("Head", "Head", "Head", 0.0, (0.0, 0.09, 0.0), (0.62, 0.0, 0.78)),
    "BHD": Place("Head", "Head", "Head", 0.0, (0.0, 0.09, 0.0), (0.62, 0.0, -0.78)),
    "SHO": Place("{s}Shoulder", "{s}Arm", "{s}Arm", 0.0, (-0.015, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "UPA": Place("{s}Arm", "{s}Arm", "{s}ForeArm", 0.55, (0.0, 0.0, 0.0), (0.0, 1.0, -0.3)),
    "ELB": Place("{s}Arm", "{s}Arm", "{s}ForeArm", 0.97, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "FRM": Place("{s}ForeArm", "{s}ForeArm", "{s}Hand", 0.5, (0.0, 0.0, 0.0), (0.0, 1.0, -0.3)),
    "WRA": Place("{s}ForeArm", "{s}ForeArm", "{s}Hand", 0.88, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "WRB": Place("{s}ForeArm", "{s}ForeArm", "{s}Hand", 0.88, (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
    "FIN": Place("{s}Hand", "{s}Hand", "{s}HandMiddle1", 0.9, (0.0, 0.0, 0.01), (0.0, 1.0, 0.0)),
    "ASI": Place("Hips", "{s}UpLeg", "{s}UpLeg", 0.0, (0.025, 0.085, 0.0), (0.0, 0.0, 1.0)),
    "PSI": Place("Hips", "Hips", "{s}UpLeg", 0.55, (0.0, 0.08, 0.0), (0.0, 0.0, -1.0)),
    "THI": Place("{s}UpLeg", "{s}UpLeg", "{s}Leg", 0.55, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    "KNE": Place("{s}UpLeg", "{s}UpLeg", "{s}Leg", 0.98, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    "TIB": Place("{s}Leg", "{s}Leg", "{s}Foot", 0.5, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    "ANK": Place("{s}Leg", "{s}Leg", "{s}Foot", 0.94, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    "HEE": Place("{s}Foot", "{s}Foot", "{s}Foot", 0.0, (0.0, -0.03, 0.0), (0.0, 0.0, -1.0)),
    "TOE": Place("{s}Foot", "{s}Foot", "{s}ToeBase", 0.93, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
}
_MIDDLE: dict[str, Place] = {
    "C7": Place("Spine2", "LeftArm", "RightArm", 0.5, (0.0, 0.055, 0.0), (0.0, 0.0, -1.0)),
    "T10": Place("Spine2", "Hips", "Spine2", 0.85, (0.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
    "CLAV": Place("Spine2", "LeftArm", "RightArm", 0.5, (0.0, 0.005, 0.0), (0.0, 0.0, 1.0)),
    "STRN": Place("Spine2", "LeftArm", "RightArm", 0.5, (0.0, -0.15, 0.0), (0.0, 0.0, 1.0)),
    "RBAK": Place("Spine2", "LeftArm", "RightArm", 0.72, (0.0, -0.09, 0.0), (0.0, 0.0, -1.0)),
}


_SKIN: dict[str, tuple[str, ...]] = {
    "Hips": ("Hips", "Spine"),
    "Spine2": ("Spine", "Spine1", "Spine2", "Neck"),
}
"""Joints whose skin may carry a marker; by default the joint that the marker follows and those below it."""


class Marker(NamedTuple):
    """A marker: its name, the joint it follows, and its place from that joint in the rest pose [m], file axes."""

    name: str
    joint: int
    offset_m: Array


def markers(
    mesh: SkinnedMesh, roles: Sequence[str], rest_positions_m: Array, *, floor_m: float | None = None
) -> list[Marker]:
    """Return the Plug-in Gait markers on a mannequin in its rest pose.

    Args:
        mesh: of these joints.
        roles, rest_positions_m, floor_m: as `mannequin_mesh`.

    Raises:
        FormatError: as `mannequin_mesh`.
    """
    rig = MannequinRig.of(roles, rest_positions_m, floor_m)
    found = [_marker(rig, mesh, name, place, "", 1.0) for name, place in _MIDDLE.items()]
    for side, x in (("Left", 1.0), ("Right", -1.0)):
        found += [_marker(rig, mesh, side[0] + name, place, side, x) for name, place in _SIDED.items()]
    return found


def _marker(rig: MannequinRig, mesh: SkinnedMesh, name: str, place: Place, side: str, x: float) -> Marker:
    role, start, end = (text.format(s=side) for text in place[:3])
    mirror = np.array([x, 1.0, 1.0])
    origin = (1 - place.share) * rig.at(start) + place.share * rig.at(end)
    origin = origin + mirror * place.shift * rig.girth
    way = mirror * place.way / np.linalg.norm(place.way)
    below = (role, *(child for child, parent in OUTPUT_PARENT.items() if parent == role))
    joints = [rig.joint(one) for one in _SKIN.get(role, below)]
    distance, carrier = _leaves(mesh, joints, origin, way)
    joint = carrier if role == "Spine2" else rig.joint(role)  # in a short chest the back belongs to the spine
    at = origin + (distance + MARKER_RADIUS_M) * way
    return Marker(name, joint, at - rig.rest_m[joint])


def _leaves(mesh: SkinnedMesh, joints: list[int], origin: Array, way: Array) -> tuple[float, int]:
    """Return the distance from `origin` at which a ray leaves the skin of some joints [m], and the joint of that
    skin.

    Source: Moeller & Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
    """
    follows = np.any(np.isin(mesh.joint_indices, joints) & (mesh.weights > 0.02), axis=1)
    triangles = mesh.triangles[follows[mesh.triangles].any(axis=1)]
    corners = mesh.vertices_m[triangles].astype(np.float64)
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(way, ac)
    determinant = np.einsum("ij,ij->i", ab, p)
    usable = np.abs(determinant) > 1e-14
    scale = 1.0 / np.where(usable, determinant, 1.0)
    t = origin - a
    u = np.einsum("ij,ij->i", t, p) * scale
    q = np.cross(t, ab)
    v = (q @ way) * scale
    distance = np.einsum("ij,ij->i", ac, q) * scale
    hit = usable & (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (distance > 0)
    if not hit.any():
        raise FormatError(
            "export.no_skin",
            "the skeleton's proportions are so unusual that no marker finds the skin; export fbx or csv",
        )
    last = int(np.argmax(np.where(hit, distance, -1.0)))
    return float(distance[last]), int(mesh.joint_indices[triangles[last, 0], 0])
