"""Points of a robot over many configurations, with Jacobians, contacts, and the centre of mass.

Configurations and steps contain only the base and the active hinges ("reduced").
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from studio.engine.robots.body.collisions import ContactFinder, Found
from studio.engine.robots.body.robot import Robot
from studio.engine.robots.free_joint import FREE, FREE_DOFS
from studio.engine.whole_take.finish.trajectory import point_jacobians

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactRows:
    """Contacts nearer than `collisions.NEAR_M`, the deepest one of each pair of bodies in a frame.

    Attributes:
        frames: frame of each contact, shape (count,).
        bodies: shape (count, 2); 0 = the floor.
        distance_m: negative = they overlap, shape (count,).
        rows: derivative of the distance by each reduced degree of freedom, shape (count, nv).
    """

    frames: NDArray[np.int64]
    bodies: NDArray[np.int64]
    distance_m: Array
    rows: Array

    @property
    def on_floor(self) -> NDArray[np.bool_]:
        """Whether each contact is with the floor, shape (count,)."""
        return (self.bodies == 0).any(axis=1)

    def part(self, chosen: NDArray[np.bool_]) -> "ContactRows":
        """Return the chosen contacts."""
        return ContactRows(
            self.frames[chosen], self.bodies[chosen], self.distance_m[chosen], self.rows[chosen]
        )


@dataclass(frozen=True)
class Linearised:
    """Points and Jacobians of many configurations.

    Attributes:
        points_m: shape (frame_count, point_count, 3).
        jacobians: shape (frame_count, 3 * point_count, nv).
        contacts: None where not requested.
        mass_m: centres of mass, shape (frame_count, 3).
        mass_jacobians: their Jacobians, shape (frame_count, 3, nv); None where not requested.
    """

    points_m: Array
    jacobians: Array
    contacts: ContactRows | None
    mass_m: Array
    mass_jacobians: Array | None


class RobotKinematics:
    """Kinematics of a robot."""

    def __init__(self, robot: Robot) -> None:
        model = robot.model
        self._model, self._data = model, mujoco.MjData(model)
        self._contacts = ContactFinder(model, robot.active)
        self._sites = robot.site_ids
        self.dofs = np.concatenate([np.arange(FREE_DOFS), FREE_DOFS + np.flatnonzero(robot.active)])
        self._columns = np.concatenate([np.arange(FREE), FREE + np.flatnonzero(robot.active)])
        self._still = robot.standing
        self._moves = body_dofs(model)[:, self.dofs]
        self._mask = np.repeat(self._moves[model.site_bodyid[self._sites]], 3, axis=0)

    def reduced(self, q: Array) -> Array:
        """Return whole configurations without inactive hinges, shape (frame_count, 7 + active)."""
        return q[:, self._columns]

    def whole(self, reduced: Array) -> Array:
        """Return whole configurations, shape (frame_count, nq); other hinges keep their rest."""
        out = np.tile(self._still, (len(reduced), 1))
        out[:, self._columns] = reduced
        return out

    def linearised(self, reduced: Array, *, contacts: bool = False, mass: bool = False) -> Linearised:
        """Return points of reduced configurations, shape (frame_count, 7 + active), with requested extras."""
        model, data, frames = self._model, self._data, len(reduced)
        points = np.empty((frames, len(self._sites), 3))
        motion, centre = np.empty((frames, len(self.dofs), 6)), np.empty((frames, 1, 3))
        mass_rows = np.empty((frames, 3, len(self.dofs))) if mass else None
        whole_row = np.empty((3, model.nv))
        found = []
        for t, q in enumerate(self.whole(reduced)):
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            data.site_xpos.take(self._sites, axis=0, out=points[t], mode="clip")
            data.cdof.take(self.dofs, axis=0, out=motion[t], mode="clip")
            centre[t] = data.subtree_com[1]
            if mass_rows is not None:
                mujoco.mj_jacSubtreeCom(model, data, whole_row, 1)
                mass_rows[t] = whole_row[:, self.dofs]
            if contacts:
                found.append(self._contacts.found(data))
        jacobians = point_jacobians(points - centre, motion)
        jacobians *= self._mask
        return Linearised(
            points,
            jacobians,
            self._rows(found, motion, centre) if contacts else None,
            centre[:, 0],
            mass_rows,
        )

    def _rows(self, found: list[Found], motion: Array, centre: Array) -> ContactRows:
        counts = [len(one[3]) for one in found]
        frames = np.repeat(np.arange(len(found)), counts)
        bodies = np.concatenate([one[0] for one in found])
        distance = np.concatenate([one[3] for one in found])
        keep = _deepest(frames, bodies, distance)
        places = np.concatenate([one[1] for one in found])[keep]
        ways = np.concatenate([one[2] for one in found])[keep]
        frames, bodies, distance = frames[keep], bodies[keep], distance[keep]
        arms = places - centre[frames, 0]
        rows = contact_rows(arms, ways, motion[frames]) * (
            self._moves[bodies[:, 1]] - self._moves[bodies[:, 0]]
        )
        return ContactRows(frames, bodies, distance, rows)


def contact_rows(arms: Array, ways: Array, motion: Array) -> Array:
    """Return the speed of points along directions by each degree of freedom, as if all moved them, shape (count, nv).

    Args:
        arms: points from the centre of mass of the tree [m], shape (count, 3).
        ways: directions, shape (count, 3).
        motion: MuJoCo's `cdof`, shape (nv, 6) or (count, nv, 6).
    """
    screw = np.concatenate([np.cross(arms, ways), ways], axis=1)  # of a force along the direction
    return np.matmul(motion, screw[..., None])[..., 0]


def body_dofs(model: mujoco.MjModel) -> Array:
    """Return 1 where a degree of freedom moves a body, shape (nbody, nv)."""
    out = np.zeros((model.nbody, model.nv))
    for body in range(1, model.nbody):
        first, count = model.body_dofadr[body], model.body_dofnum[body]
        out[body] = out[model.body_parentid[body]]
        out[body, first : first + count] = 1.0
    return out


def _deepest(frames: NDArray[np.int64], bodies: NDArray[np.int64], distance: Array) -> NDArray[np.int64]:
    """The deepest contact of each pair of bodies in each frame."""
    pair = np.sort(bodies, axis=1)
    order = np.lexsort((distance, pair[:, 1], pair[:, 0], frames))
    key = np.column_stack([frames, pair])[order]
    first = np.ones(len(order), dtype=bool)
    first[1:] = (np.diff(key, axis=0) != 0).any(axis=1)
    return order[first]
