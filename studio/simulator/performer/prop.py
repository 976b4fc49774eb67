"""A prop in the simulated performer's hand: its motion, and its mesh for depth cameras."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import matrices, quaternions, rotation_xyz
from studio.engine.model.joints import INDEX
from studio.engine.model.rigid_body import RigidShape
from studio.simulator.body.bones import BONE
from studio.simulator.performer.motion import PerformerMotion

Array = NDArray[np.float64]

_PALM_M = 0.022
"""From the hand joint to the palm."""

_THIN_M = 0.07
"""Largest thickness of a prop in a closed hand, across the palm; thicker ones lie on an open hand."""

_CLOSED, _OPEN = 0.15, 0.75
_ALONG = 0.25
"""Distance of a thin prop's grip from its middle, as a share of the length."""

_TILT = 0.25
_ROUND, _RINGS = 24, 12
RATE_HZ = 120.0


@dataclass(frozen=True)
class PropMesh:
    """A closed mesh about the prop's origin: vertices [m], triangles, reflectivity; see `BodyMesh`."""

    vertices_m: NDArray[np.float32]
    triangles: NDArray[np.int32]
    albedo: NDArray[np.float32]


class HeldProp:
    """A prop fixed to a performer's hand from the start of the performance.

    Args:
        shape: of the prop.
        performance: the performer's motion; see `holding`.
        hand: `left_hand` or `right_hand`.

    Attributes:
        mesh: of the prop.
        enters_s: time of appearance, the end of the calibration part [s].
    """

    def __init__(self, shape: RigidShape, performance: PerformerMotion, hand: str) -> None:
        self.mesh = prop_mesh(shape)
        self.enters_s = performance.calibration_s or 0.0
        self._performance, self._hand = performance, hand
        self._place, self._turn = _grip(shape, 1.0 if hand == "left_hand" else -1.0)

    def at(self, time_s: float) -> NDArray[np.float32]:
        """Return the vertices at a time [m], shape (V, 3)."""
        place, turn = self.pose(time_s)
        return (self.mesh.vertices_m @ turn.T + place).astype(np.float32)

    def pose(self, time_s: float) -> tuple[Array, Array]:
        """Return the origin on the stage [m], shape (3,), and the rotation, shape (3, 3)."""
        joints, turns = self._performance.at(time_s)
        hand = matrices(turns[BONE[self._hand]])
        return joints[INDEX[self._hand]] + hand @ self._place, hand @ self._turn

    def truth_csv(self) -> bytes:
        """Return the prop's poses at 120 Hz: time, x, y, z [m], rotation w, x, y, z."""
        times = np.arange(self.enters_s, self._performance.motion.duration_s, 1.0 / RATE_HZ).tolist()
        lines = ["time_s,x_m,y_m,z_m,qw,qx,qy,qz"]
        for time_s in times:
            place, turn = self.pose(time_s)
            values = (*place.tolist(), *quaternions(turn[None])[0].tolist())
            lines.append(",".join([f"{time_s:.5f}", *(f"{value:.5f}" for value in values)]))
        return "\n".join([*lines, ""]).encode()


def holding(performance: PerformerMotion, shape: RigidShape, hand: str) -> PerformerMotion:
    """Return the performance with one hand bent around a prop."""
    hands = performance.motion.hands_open.copy()
    side = 0 if hand == "left_hand" else 1
    first = round((performance.calibration_s or 0.0) / performance.motion.frame_s)
    hands[first:, side] = _CLOSED if np.sort(shape.edges_m)[1] < _THIN_M else _OPEN
    return replace(performance, motion=replace(performance.motion, hands_open=hands))


def _grip(shape: RigidShape, sign: float) -> tuple[Array, Array]:
    """Return the prop's origin relative to the hand joint [m] and its rotation, in the hand's T-pose axes: palm down,
    thumb towards -y."""
    edges = shape.edges_m
    longest = int(edges.argmax())
    if np.sort(edges)[1] >= _THIN_M:
        return np.array([sign * 0.02, 0.0, -_PALM_M - edges[2] / 2]), np.eye(3)
    x, y, z = np.eye(3)
    upright = {0: (y, -x, z), 1: (x, y, z), 2: (x, -z, y)}[longest]  # the longest axis becomes y
    turn = rotation_xyz(0.0, 0.0, sign * _TILT) @ np.stack(upright, axis=1)
    middle = -_ALONG * edges[longest] * turn[:, longest]
    return middle + np.array([0.0, 0.0, -_PALM_M - np.sort(edges)[1] / 2]), turn


def prop_mesh(shape: RigidShape, albedo: float = 0.5) -> PropMesh:
    """Return the closed mesh of a shape, triangles counter-clockwise seen from outside."""
    half = shape.edges_m / 2
    if shape.kind == "box":
        vertices = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        triangles = [one for a, b, c, d in quads for one in ((a, b, c), (a, c, d))]
    else:
        if shape.kind == "sphere":
            angles = np.linspace(0.0, np.pi, _RINGS + 1)
            profile = [(np.sin(angle), -np.cos(angle)) for angle in angles.tolist()]
        else:
            profile = [(0.0, -1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 1.0)]
        around = np.arange(_ROUND) * 2 * np.pi / _ROUND
        rings = [
            np.stack([r * np.cos(around), r * np.sin(around), np.full(_ROUND, z)], axis=1) for r, z in profile
        ]
        axis = "xyz".index(shape.axis) if shape.kind == "cylinder" else 2
        order = [(k - axis + 2) % 3 for k in range(3)]  # z of the profile becomes the axis, without mirroring
        vertices = np.concatenate(rings)[:, order] * half
        triangles = []
        for ring in range(len(profile) - 1):
            for k in range(_ROUND):
                a, b = ring * _ROUND + k, ring * _ROUND + (k + 1) % _ROUND
                triangles += [(a, b, b + _ROUND), (a, b + _ROUND, a + _ROUND)]
    return PropMesh(
        vertices.astype(np.float32), np.array(triangles, np.int32), np.full(len(vertices), albedo, np.float32)
    )
