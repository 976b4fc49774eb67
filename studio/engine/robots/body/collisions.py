"""Contacts of a robot with itself and with the floor."""

from itertools import combinations

import mujoco
import numpy as np
from numpy.typing import NDArray

FLOOR = "studio_floor"
NEAR_M = 0.01
"""Largest distance at which contacts are found."""

DEEP_M = 0.01
"""Overlap above which parts are pushed apart along the line between their centres of mass: the shortest way out of a
deep overlap may lead through the other part."""

FAMILY = 2
"""Number of hinges up to which two bodies touch by their construction."""


def with_floor(spec: mujoco.MjSpec, model: mujoco.MjModel, active: NDArray[np.bool_]) -> None:
    """Give a robot a floor at z = 0, and exclude pairs of bodies that cannot be kept apart.

    These are bodies with at most `FAMILY` moving hinges between them, and bodies that overlap in the zero pose.

    Args:
        spec: modified.
        model: compiled from `spec` before.
        active: hinges that move, shape (hinge_count,); bodies on other hinges move with their parents.
    """
    hard = (model.geom_contype | model.geom_conaffinity) != 0
    for geom in spec.geoms:
        geom.margin = 0.5 * NEAR_M
        geom.gap = 0.5 * NEAR_M
        if geom.contype or geom.conaffinity:
            geom.contype = geom.conaffinity = 1
    spec.worldbody.add_geom(
        name=FLOOR, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 1.0], contype=1, conaffinity=1, group=4,
        margin=0.5 * NEAR_M, gap=0.5 * NEAR_M,
    )  # fmt: skip
    known = {frozenset((one.bodyname1, one.bodyname2)) for one in spec.excludes}
    names = [model.body(k).name for k in range(model.nbody)]
    overlapping = _overlapping(model)
    moving = _moving(model, active)
    for one, other in combinations(sorted(set(model.geom_bodyid[hard].tolist())), 2):
        pair = frozenset((names[one], names[other]))
        if pair not in known and (
            _hinges_between(model, moving, one, other) <= FAMILY or (one, other) in overlapping
        ):
            spec.add_exclude(bodyname1=names[one], bodyname2=names[other])


def _overlapping(model: mujoco.MjModel) -> set[tuple[int, int]]:
    """Pairs of bodies closer than `NEAR_M` in the zero pose, the lower number first."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    bodies = np.sort(model.geom_bodyid[data.contact.geom], axis=1)
    return {(int(a), int(b)) for a, b in bodies[data.contact.dist < NEAR_M]}


def _moving(model: mujoco.MjModel, active: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Number of moving hinges of each body, shape (nbody,)."""
    return np.bincount(model.jnt_bodyid[1:], weights=active, minlength=model.nbody).astype(np.int64)


def _hinges_between(model: mujoco.MjModel, moving: NDArray[np.int64], one: int, other: int) -> int:
    """Number of moving hinges between two bodies."""
    ways = []
    for body in (one, other):
        up = []
        while body > 0:
            up.append(body)
            body = int(model.body_parentid[body])
        ways.append(up)
    apart = set(ways[0]) ^ set(ways[1])
    return int(sum(moving[body] for body in apart))


Found = tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Contacts of a configuration: bodies, places, directions, distances; see `ContactFinder.found`."""


class ContactFinder:
    """Finds a robot's contacts, configuration by configuration."""

    def __init__(self, model: mujoco.MjModel, active: NDArray[np.bool_]) -> None:
        """`active`: hinges that move, shape (hinge_count,)."""
        self._model = model
        self._carrier = np.arange(model.nbody)
        for body in range(2, model.nbody):
            joint = model.body_jntadr[body]
            if joint < 0 or not active[joint - 1]:
                self._carrier[body] = self._carrier[model.body_parentid[body]]

    def found(self, data: mujoco.MjData) -> Found:
        """Return the contacts in `data`, with its kinematics computed.

        Returns:
            Bodies of each contact, shape (count, 2), 0 = the floor; places [m], shape (count, 3); directions from the
            first body to the second, shape (count, 3); distances [m], shape (count,), negative = they overlap.
        """
        mujoco.mj_collision(self._model, data)
        contact = data.contact
        bodies = self._model.geom_bodyid[contact.geom].astype(np.int64).reshape(-1, 2)
        ways, distance = contact.frame[:, :3].copy(), contact.dist.copy()
        deep = (distance < -DEEP_M) & (bodies != 0).all(axis=1)
        if deep.any():
            first, second = self._carrier[bodies[deep]].T
            apart = data.xipos[second] - data.xipos[first]
            ways[deep] = apart / np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1e-9)
        return bodies, contact.pos.copy(), ways, distance
