"""A rig posed by the world rotations of its mapped bones; the others keep their rest pose relative to their
parents."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.retarget.rig import Rig
from studio.engine.base.quaternions import inverse, multiply, rotate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Posed:
    """A rig over time. Parts are turned in place, then `place` computes all bones.

    Attributes:
        rig: one skeleton.
        turns: joint -> its world rotations from the rest pose, shape (F, 4), of every turned bone.
        hips: index of the hips, whose position is given.
        hips_m: their positions, shape (F, 3).
    """

    rig: Rig
    turns: dict[int, Array]
    hips: int
    hips_m: Array

    def place(self) -> tuple[Array, Array]:
        """Return world positions (F, J, 3) and world rotations from the rest pose (F, J, 4)."""
        frames, joints = len(self.hips_m), len(self.rig.parents)
        rest = self.rig.positions_m
        positions, turns = np.empty((frames, joints, 3)), np.empty((frames, joints, 4))
        for joint, parent in enumerate(self.rig.parents.tolist()):
            if parent < 0:
                positions[:, joint], turns[:, joint] = rest[joint], [1.0, 0.0, 0.0, 0.0]
            else:
                arm = rotate(turns[:, parent], rest[joint] - rest[parent])
                positions[:, joint], turns[:, joint] = positions[:, parent] + arm, turns[:, parent]
            if joint in self.turns:
                turns[:, joint] = self.turns[joint]
            if joint == self.hips:
                positions[:, joint] = self.hips_m
        return positions, turns


def local_of(parents: NDArray[np.int64], positions: Array, rotations: Array) -> tuple[Array, Array]:
    """Return one pose's positions and rotations in the axes of the parents, shapes (J, 3), (J, 4)."""
    below = np.flatnonzero(parents >= 0)
    above = parents[below]
    places, turns = positions.copy(), rotations.copy()
    back = inverse(rotations[above])
    places[below] = rotate(back, positions[below] - positions[above])
    turns[below] = multiply(back, rotations[below])
    return places, turns
