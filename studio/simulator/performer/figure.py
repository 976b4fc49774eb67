"""A performer's mesh, posed at any instant."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.quaternions import multiply
from studio.engine.model.joints import INDEX
from studio.simulator.body.bones import ANCHORS, BONE, BONE_COUNT, BONES
from studio.simulator.body.cloth import Cloth
from studio.simulator.body.frame import SIDES
from studio.simulator.body.hand import BONES_PER_HAND
from studio.simulator.body.mesh import BodyMesh, hand_axes
from studio.simulator.body.skinning import skin
from studio.simulator.performer.motion import PerformerMotion

Array = NDArray[np.float64]
_ANCHOR_JOINTS = [INDEX[name] for name in ANCHORS]
_OPENNESS_STEPS = 64


class Figure:
    """A performer in motion, for one camera; the clothes depend on earlier frames.

    Args:
        mesh: the body.
        performance: its motion.

    Attributes:
        enters_s: entrance of the performer [s]; absent before it.
    """

    def __init__(self, mesh: BodyMesh, performance: PerformerMotion) -> None:
        self.mesh, self.enters_s = mesh, performance.enters_s
        self._performance = performance
        self._cloth = Cloth(mesh.looseness_m)
        self._hands = _bent_hands(mesh)

    def at(self, time_s: float) -> NDArray[np.float32]:
        """Return the vertices at a time [m], shape (V, 3); times must not decrease."""
        vertices = skin(self.mesh.vertices_m, *self.mesh.skin, *self.bones_at(time_s))
        self._cloth.follow(vertices, time_s)
        return vertices

    def bones_at(self, time_s: float) -> tuple[Array, Array, Array]:
        """Return every bone's rotation, wxyz, (B, 4), and its anchor in the T-pose and now [m], (B, 3)."""
        joints, turns = self._performance.at(time_s)
        openness = self._performance.motion.hands_open_at(time_s)
        quaternions, places = np.empty((BONE_COUNT, 4)), np.empty((BONE_COUNT, 3))
        quaternions[: len(BONES)] = turns
        places[: len(BONES)] = joints[_ANCHOR_JOINTS]
        for i, (side, _) in enumerate(SIDES):
            fingers = slice(len(BONES) + i * BONES_PER_HAND, len(BONES) + (i + 1) * BONES_PER_HAND)
            bent, roots = (value[i, round(openness[i] * _OPENNESS_STEPS)] for value in self._hands)
            hand = turns[BONE[f"{side}_hand"]]
            quaternions[fingers] = multiply(hand, bent)
            matrix = Rotation.from_quat(hand, scalar_first=True).as_matrix()
            places[fingers] = joints[INDEX[f"{side}_wrist"]] + roots @ matrix.T
        return quaternions, self.mesh.anchors_m, places


def _bent_hands(mesh: BodyMesh) -> tuple[Array, Array]:
    """Finger rotations, shape (2, S, 15, 4), and roots from the wrist [m], shape (2, S, 15, 3), in T-pose axes."""
    turns = np.empty((2, _OPENNESS_STEPS + 1, BONES_PER_HAND, 4))
    roots = np.empty((2, _OPENNESS_STEPS + 1, BONES_PER_HAND, 3))
    for step in range(_OPENNESS_STEPS + 1):
        rotations, places = mesh.hand.bend(step / _OPENNESS_STEPS)
        for i, (_, sign) in enumerate(SIDES):
            axes = hand_axes(sign)
            turned = (axes @ rotations @ axes.T).reshape(-1, 3, 3)
            turns[i, step] = Rotation.from_matrix(turned, assume_valid=True).as_quat(scalar_first=True)
            roots[i, step] = places.reshape(-1, 3) @ axes.T
    return turns, roots
