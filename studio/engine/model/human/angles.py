"""Hinge angles of world rotations: a pose of the skeleton as a configuration of the humanoid."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.model.human.humanoid import BODY_JOINTS, Humanoid
from studio.engine.model.human.ranges import SHOULDER_AXIS_DEG, dofs_of
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_PARENTS

_LETTERS = "XYZ"


@dataclass(frozen=True)
class _Group:
    """Joints whose hinges turn about the same sequence of stage axes.

    A shoulder's first axis is tilted about z: R(axis, a) R(z, b) R(x, c) = R(z, tilt) R(x, a) R(z, b - tilt) R(x, c).
    Without the tilt it is also such a sequence.
    """

    sequence: str
    bodies: NDArray[np.int64]  # index into BODY_JOINTS
    tilt: NDArray[np.float64]  # [rad], one per body
    hinges: NDArray[np.int64]  # index of each angle among all hinges, -1 = no such hinge, (body, 3)
    signs: NDArray[np.float64]  # sign of the hinge along the stage axis, (body, 3)


def _groups() -> tuple[_Group, ...]:
    rows: dict[str, list[tuple[int, float, list[int], list[float]]]] = {}
    at = 0
    for body, name in enumerate(BODY_JOINTS):
        dofs = dofs_of(name)
        if not dofs:
            continue
        largest = [int(np.argmax(np.abs(dof.axis))) for dof in dofs]
        letters = "".join(_LETTERS[k] for k in largest)
        letters += "".join(letter for letter in _LETTERS if letter not in letters)[: 3 - len(letters)]
        tilted = letters[0] == letters[2]
        tilt = math.radians(SHOULDER_AXIS_DEG) * (1 if name.startswith("Left") else -1) if tilted else 0.0
        missing = 3 - len(dofs)
        signs = [math.copysign(1.0, dof.axis[k]) for dof, k in zip(dofs, largest, strict=True)]
        row = (body, tilt, [*range(at, at + len(dofs)), *[-1] * missing], signs + [1.0] * missing)
        rows.setdefault(letters, []).append(row)
        at += len(dofs)
    return tuple(
        _Group(sequence, *(np.array(column) for column in zip(*group, strict=True)))
        for sequence, group in rows.items()
    )


_GROUPS = _groups()
_BODY_OUTPUT = np.array([OUTPUT_INDEX[name] for name in BODY_JOINTS])


def _both_triples(group: _Group, local: Rotation) -> NDArray[np.float64]:
    """The two triples of hinge angles [rad] that give the same rotation, shape (2, body_count, 3)."""
    first = (Rotation.from_euler("z", -group.tilt[:, None]) * local).as_euler(
        group.sequence, suppress_warnings=True
    )
    second = first + math.pi
    proper = group.sequence[0] == group.sequence[2]
    second[:, 1] = -first[:, 1] if proper else math.pi - first[:, 1]
    both = np.stack([first, second])
    both[:, :, 1] += group.tilt
    return group.signs * ((both + math.pi) % (2 * math.pi) - math.pi)


def configuration_of(
    humanoid: Humanoid, hips: NDArray[np.float64], rotations: NDArray[np.float64], *, limited: bool = True
) -> NDArray[np.float64]:
    """Return the humanoid's configuration nearest to a pose, shape (nq,).

    Args:
        humanoid: the model.
        hips: position of the hips [m].
        rotations: world rotations of the output joints, shape (52, 3, 3).
        limited: whether angles are clamped to their ranges.
    """
    parents = rotations[OUTPUT_PARENTS[_BODY_OUTPUT]]
    local = np.einsum("jba,jbc->jac", parents, rotations[_BODY_OUTPUT])
    low, high = np.append(humanoid.range_rad, [[0.0, 0.0]], axis=0).T  # a missing hinge stays at 0
    angles = np.zeros(len(low))
    for group in _GROUPS:
        both = _both_triples(group, Rotation.from_matrix(local[group.bodies], assume_valid=True))
        excess = np.maximum(low[group.hinges] - both, 0.0) + np.maximum(both - high[group.hinges], 0.0)
        nearer = excess.sum(axis=2).argmin(axis=0)
        angles[group.hinges] = both[nearer, np.arange(len(group.bodies))]
    q = np.empty(humanoid.model.nq)
    q[:3] = hips
    q[3:7] = Rotation.from_matrix(rotations[0], assume_valid=True).as_quat(scalar_first=True)
    q[7:] = np.clip(angles[:-1], *humanoid.range_rad.T) if limited else angles[:-1]
    mujoco.mj_normalizeQuat(humanoid.model, q)
    return q
