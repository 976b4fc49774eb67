"""Points from several cameras' rays."""

import numpy as np

from studio.engine.calibration.views.bodies import Array
from studio.engine.calibration.views.rig import CameraRig

_ROUNDS = 4


def triangulate(rig: CameraRig, points: Array, weight: Array, rounds: int = _ROUNDS) -> Array:
    """Return the points nearest to the rays [m], shape (..., 3); NaN where fewer than two cameras see one.

    Args:
        points: pixels from the pictures' middles, shape (camera_count, ..., 2).
        weight: inverse squared errors [1/pixel^2], shape (camera_count, ...); 0 = unseen.
        rounds: how often weights are set anew, by depth and against outliers.
    """
    rays = np.stack([rig.rays_of(c, points[c]) for c in range(len(points))])
    ways = np.concatenate([rays, np.ones((*rays.shape[:-1], 1))], axis=-1)
    ways /= np.linalg.norm(ways, axis=-1, keepdims=True)
    ways = np.einsum("cba,c...b->c...a", rig.turns, ways)
    centres = -np.einsum("cba,cb->ca", rig.turns, rig.shifts).reshape(
        len(points), *(1,) * (weight.ndim - 1), 3
    )
    across = np.eye(3) - ways[..., :, None] * ways[..., None, :]
    used = weight * rig.focals.reshape(-1, *(1,) * (weight.ndim - 1)) ** 2
    robust = np.ones_like(weight)
    out = np.zeros((*weight.shape[1:], 3))
    enough = (weight > 0).sum(axis=0) >= 2
    for k in range(rounds):
        A = np.einsum("c...,c...ab->...ab", used * robust, across)
        b = np.einsum("c...,c...ab,c...b->...a", used * robust, across, np.broadcast_to(centres, ways.shape))
        A = np.where(enough[..., None, None], A, np.eye(3))
        A = A + 1e-9 * np.trace(A, axis1=-2, axis2=-1)[..., None, None] * np.eye(3)
        out = np.linalg.solve(A, b[..., None])[..., 0]
        if k + 1 == rounds:
            break
        away = out - centres
        depth = np.maximum((away * ways).sum(axis=-1), 0.3)
        rest = np.linalg.norm(np.einsum("c...ab,c...b->c...a", across, away), axis=-1) / depth
        used = weight * rig.focals.reshape(-1, *(1,) * (weight.ndim - 1)) ** 2 / depth**2
        robust = 1.0 / (1.0 + used * depth**2 * rest**2 / 9.0)
    return np.where(enough[..., None], out, np.nan)
