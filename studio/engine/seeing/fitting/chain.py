"""The tracker's kinematic chain: the humanoid's bodies and hinges as plain arrays, and their motion.

The hinges, their axes and their limits are those of `human.build_humanoid`. Angles that depth cameras cannot separate
are coupled: the three spine joints share their angles, and so do neck and head. A pose's tangent step is the hips'
translation [m] and rotation [rad] along the frame's axes, then one angle per degree of freedom.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.model.human.chain import placed
from studio.engine.model.human.humanoid import BODY_JOINTS, Humanoid
from studio.engine.model.human.ranges import dofs_of
from studio.engine.model.joints import OUTPUT_PARENT

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
    """Limits and priors of every angle, each of shape (dof_count,) [rad]; `names` such as `LeftArm_twist`."""

    names: tuple[str, ...]
    low: Array
    high: Array
    rest: Array
    spread: Array


@dataclass(frozen=True)
class Pose:
    """The hips' position [m], shape (3,), and rotation, shape (3, 3), and the angles [rad], shape (dof_count,)."""

    root: Array
    rotation: Array
    angles: Array

    def moved(self, step: Array, limits: Limits) -> "Pose":
        """Return the pose after a tangent step, shape (6 + dof_count,), with its angles clamped to the limits."""
        return Pose(
            self.root + step[:3],
            rotation_of(step[3:6]) @ self.rotation,
            np.clip(self.angles + step[ROOT_DOFS:], limits.low, limits.high),
        )

    def with_angles(self, angles: Array) -> "Pose":
        """Return the pose with other angles."""
        return replace(self, angles=angles)

    def step_from(self, other: "Pose") -> Array:
        """Return the tangent step from another pose to this one, shape (6 + dof_count,)."""
        turn = self.rotation @ other.rotation.T
        return np.concatenate([self.root - other.root, vector_of(turn), self.angles - other.angles])


def rotation_of(vector: NDArray[np.floating]) -> Array:
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


def place_bodies(
    chain: Chain, offsets: Array, root: Array, rotation: Array, angles: Array
) -> tuple[Array, Array, Array]:
    """Return each body's position [m], shape (body_count, 3), rotation, shape (body_count, 3, 3), and each hinge's
    axis in this pose, shape (hinge_count, 3).

    Args:
        offsets: from parent to body in the T-pose [m], shape (body_count, 3).
        root, rotation, angles: of a `Pose`.
    """
    below = offsets.copy()
    below[0] = 0.0  # the pose gives the hips' position
    carrier = np.column_stack([rotation, root])
    turns, places, axes = placed(carrier, chain.parents, below, chain.owner, chain.axes, angles[chain.dofs])
    return places, turns, axes


@compiled
def _add_row(chain, places, axes, body, point, normal, row):
    """Write into `row`, zeros of shape (6 + dof_count,), the derivative of a body's `point` along `normal`."""
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
def rows_of(chain, places, axes, bodies, points, normals, rows):
    """Add to `rows`, shape (point_count, 6 + dof_count), the derivatives of bodies' points along their normals."""
    for p in range(len(bodies)):
        _add_row(chain, places, axes, bodies[p], points[p], normals[p], rows[p])
