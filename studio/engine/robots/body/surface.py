"""Points on the surfaces of a model's bodies."""

from collections.abc import Sequence
from itertools import product

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_RING = 2.0 * np.pi * np.arange(12) / 12.0
_AXES = np.vstack([np.eye(3), -np.eye(3)])


def surface_points(
    model: mujoco.MjModel, data: mujoco.MjData, bodies: Sequence[int], *, colliding: bool | None = None
) -> Array:
    """Return points on the surfaces of bodies at their places in `data`, world [m], shape (point_count, 3).

    Args:
        model, data: with the kinematics computed.
        bodies: the bodies.
        colliding: True = only colliding geoms, False = only the others; None = the colliding ones of each body, or
            all if it has none.
    """
    out = [np.empty((0, 3))]
    for body in bodies:
        first = model.body_geomadr[body]
        geoms = [int(geom) for geom in range(first, first + model.body_geomnum[body])] if first >= 0 else []
        hard = [geom for geom in geoms if model.geom_contype[geom] or model.geom_conaffinity[geom]]
        soft = [geom for geom in geoms if geom not in hard]
        for geom in (hard or soft) if colliding is None else hard if colliding else soft:
            local = geom_points(model, geom)
            out.append(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    return np.concatenate(out)


def geom_points(model: mujoco.MjModel, geom: int) -> Array:
    """Return points on a geom's surface in its own axes [m], shape (point_count, 3)."""
    kind, size = mujoco.mjtGeom(int(model.geom_type[geom])), model.geom_size[geom]
    kinds = mujoco.mjtGeom
    if kind == kinds.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return model.mesh_vert[first : first + count].astype(np.float64)
    if kind in (kinds.mjGEOM_SPHERE, kinds.mjGEOM_ELLIPSOID):
        return _AXES * (size[0] if kind == kinds.mjGEOM_SPHERE else size)
    if kind == kinds.mjGEOM_BOX:
        return np.array(list(product((-1.0, 1.0), repeat=3))) * size
    if kind == kinds.mjGEOM_CAPSULE:
        ends = np.array([[0.0, 0.0, size[1]], [0.0, 0.0, -size[1]]])
        return (ends[:, None] + _AXES * size[0]).reshape(-1, 3)
    if kind == kinds.mjGEOM_CYLINDER:
        ring = np.stack([np.cos(_RING), np.sin(_RING), np.zeros(12)], axis=1) * size[0]
        return np.concatenate([ring + np.array([0.0, 0.0, z]) for z in (size[1], -size[1])])
    return np.empty((0, 3))
