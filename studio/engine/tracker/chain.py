"""The tracker's kinematic chain: the humanoid's bodies and hinges as plain arrays, and their motion.

The hinges, their axes and their limits are those of `human.build_humanoid`. What no depth camera tells apart moves
together: the three spine joints share their angles, and so do neck and head. A pose's tangent step is the hips'
movement [m] and turn [rad] along the frame's axes, then one angle per degree of freedom.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.compiled import compiled
from studio.engine.human.model import BODY_JOINTS, Humanoid
from studio.engine.human.ranges import dofs_of
from studio.engine.joints import OUTPUT_PARENT

Array = NDArray[np.float64]
ROOT_DOFS = 6

_TIED = {"Spine1": "Spine", "Spine2": "Spine", "Head": "Neck"}


class Chain(NamedTuple):
    """Bodies, parents first, and hinges, in the order of `BODY_JOINTS`.

    Attributes:
        parents: of each body, -1 for the hips, shape (body_count,).
        first: index of each body's first hinge; the last entry is the number of hinges, shape (body_count + 1,).
        owner: body of each hinge, shape (hinge_count,).
        axes: of each hinge in the T-pose, shape (hinge_count, 3).
        dofs: index of each hinge's angle in a pose, shape (hinge_count,).
        path: hinges from the hips to each body, -1 past the end, shape (body_count, path_count).
    """

    parents: NDArray[np.int64]
    first: NDArray[np.int64]
    owner: NDArray[np.int64]
    axes: Array
    dofs: NDArray[np.int64]
    path: NDArray[np.int64]


@dataclass(frozen=True)
class Limits:
    """What is known of every angle beforehand, each of shape (dof_count,) [rad]; `names` as `LeftArm_twist`."""

    names: tuple[str, ...]
    low: Array
    high: Array
    rest: Array
    spread: Array


@dataclass(frozen=True)
class Pose:
    """The hips' place [m], shape (3,), and rotation, shape (3, 3), and the angles [rad], shape (dof_count,)."""

    root: Array
    rotation: Array
    angles: Array

    def moved(self, step: Array, limits: Limits) -> "Pose":
        """Return the pose after a tangent step, shape (6 + dof_count,), its angles within the limits."""
        return Pose(
            self.root + step[:3],
            rotation_of(step[3:6]) @ self.rotation,
            np.clip(self.angles + step[ROOT_DOFS:], limits.low, limits.high),
        )

    def with_angles(self, angles: Array) -> "Pose":
        """Return the pose with other angles."""
        return replace(self, angles=angles)

    def step_from(self, other: "Pose") -> Array:
        """Return the tangent step that leads from another pose here, shape (6 + dof_count,)."""
        turn = self.rotation @ other.rotation.T
        return np.concatenate([self.root - other.root, vector_of(turn), self.angles - other.angles])


def rotation_of(vector: Array) -> Array:
    """Return the rotation, 3x3, about a vector by its length [rad] (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k)


def vector_of(rotation: Array) -> Array:
    """Return the vector whose direction and length [rad] are a rotation's axis and angle."""
    vector = 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = float(np.linalg.norm(vector))
    cosine = 0.5 * (float(np.trace(rotation)) - 1.0)
    if sine < 1e-9:
        return np.zeros(3) if cosine > 0 else np.array([0.0, 0.0, np.pi])
    return vector * (np.arctan2(sine, cosine) / sine)


def chain_of(humanoid: Humanoid) -> tuple[Chain, Limits]:
    """Return the chain and the limits of a humanoid."""
    index = {name: i for i, name in enumerate(BODY_JOINTS)}
    parents = [-1 if OUTPUT_PARENT[n] is None else index[str(OUTPUT_PARENT[n])] for n in BODY_JOINTS]
    names: list[str] = []
    low, high, rest, spread = [], [], [], []
    first, owner, axes, dofs = [0], [], [], []
    hinge = 0
    for body, name in enumerate(BODY_JOINTS):
        for dof in dofs_of(name):
            key = f"{_TIED.get(name, name)}_{dof.name}"
            if key not in names:
                names.append(key)
                low.append(humanoid.range_rad[hinge, 0])
                high.append(humanoid.range_rad[hinge, 1])
                rest.append(humanoid.rest_q[hinge])
                spread.append(humanoid.spread_rad[hinge])
            owner.append(body)
            axes.append(np.array(dof.axis) / np.linalg.norm(dof.axis))
            dofs.append(names.index(key))
            hinge += 1
        first.append(hinge)
    paths = [_path(body, parents, first) for body in range(len(BODY_JOINTS))]
    path = np.full((len(paths), max(map(len, paths))), -1)
    for body, hinges in enumerate(paths):
        path[body, : len(hinges)] = hinges
    chain = Chain(np.array(parents), np.array(first), np.array(owner), np.array(axes), np.array(dofs), path)
    return chain, Limits(tuple(names), np.array(low), np.array(high), np.array(rest), np.array(spread))


def _path(body: int, parents: list[int], first: list[int]) -> list[int]:
    above = _path(parents[body], parents, first) if parents[body] >= 0 else []
    return [*above, *range(first[body], first[body + 1])]


@compiled
def place_bodies(chain, offsets, root, rotation, angles):  # type: ignore[no-untyped-def]
    """Return every body's place (body_count, 3), rotation (body_count, 3, 3), and every hinge's axis as it stands,
    shape (hinge_count, 3), of offsets from parent to body in the T-pose, shape (body_count, 3)."""
    count = len(chain.parents)
    places = np.empty((count, 3))
    rotations = np.empty((count, 3, 3))
    axes = np.empty((len(chain.owner), 3))
    for b in range(count):
        parent = chain.parents[b]
        for i in range(3):
            if parent < 0:
                places[b, i] = root[i]
            else:
                places[b, i] = places[parent, i]
            for j in range(3):
                if parent < 0:
                    rotations[b, i, j] = rotation[i, j]
                else:
                    places[b, i] += rotations[parent, i, j] * offsets[b, j]
                    rotations[b, i, j] = rotations[parent, i, j]
        for h in range(chain.first[b], chain.first[b + 1]):
            x, y, z = chain.axes[h]
            angle = angles[chain.dofs[h]]
            s, c = np.sin(angle), np.cos(angle)
            d = 1.0 - c
            for i in range(3):
                p, q, r = rotations[b, i, 0], rotations[b, i, 1], rotations[b, i, 2]
                axes[h, i] = p * x + q * y + r * z
                rotations[b, i, 0] = p * (c + x * x * d) + q * (y * x * d + z * s) + r * (z * x * d - y * s)
                rotations[b, i, 1] = p * (x * y * d - z * s) + q * (c + y * y * d) + r * (z * y * d + x * s)
                rotations[b, i, 2] = p * (x * z * d + y * s) + q * (y * z * d - x * s) + r * (c + z * z * d)
    return places, rotations, axes


@compiled
def _add_row(chain, places, axes, body, point, normal, row):  # type: ignore[no-untyped-def]
    """Write into `row`, zeros of shape (6 + dof_count,), how a step moves `point` of a body along `normal`."""
    nx, ny, nz = normal[0], normal[1], normal[2]
    row[0], row[1], row[2] = nx, ny, nz
    ax, ay, az = point[0] - places[0, 0], point[1] - places[0, 1], point[2] - places[0, 2]
    row[3], row[4], row[5] = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
    for k in range(chain.path.shape[1]):
        h = chain.path[body, k]
        if h < 0:
            break
        p = places[chain.owner[h]]
        ax, ay, az = point[0] - p[0], point[1] - p[1], point[2] - p[2]
        row[6 + chain.dofs[h]] += (
            axes[h, 0] * (ay * nz - az * ny)
            + axes[h, 1] * (az * nx - ax * nz)
            + axes[h, 2] * (ax * ny - ay * nx)
        )


@compiled
def rows_of(chain, places, axes, bodies, points, normals, rows):  # type: ignore[no-untyped-def]
    """Add to `rows`, shape (point_count, 6 + dof_count), how a step moves points of bodies along their normals."""
    for p in range(len(bodies)):
        _add_row(chain, places, axes, bodies[p], points[p], normals[p], rows[p])
