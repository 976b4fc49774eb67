"""First places of the cameras: the network's guesses of the body put in front of each camera, then brought together."""

import numpy as np

from studio.engine.base.geometry import fit_rigid, make_transform, rotation_between, transform_points
from studio.engine.calibration.views.bodies import Array
from studio.engine.calibration.views.tracks import Track, nearest
from studio.engine.calibration.views.view import OTHER_SIDE

_LEAST_JOINTS = 8
_FAR_DEG = 30.0
_FAR_M = 0.25


def bodies(track: Track) -> Array:
    """Return the guessed bodies where the picture shows them [m], in the camera's frame, shape (frame_count, 17, 3).

    NaN where too little is seen. The guess lies along the line of sight to the body.
    """
    rays = track.points / track.focal
    out = np.full(track.world_m.shape, np.nan)
    for f in np.flatnonzero(track.seen.sum(axis=1) >= _LEAST_JOINTS):
        seen = track.seen[f]
        middle = np.append(np.median(rays[f, seen], axis=0), 1.0)
        body = track.world_m[f, seen] @ rotation_between(np.array([0.0, 0.0, 1.0]), middle / np.linalg.norm(middle)).T
        out[f, seen] = body + _place(body, rays[f, seen])
    out[~(out[..., 2] > 0.1)] = np.nan
    return out


def _place(body: Array, rays: Array) -> Array:
    """Return the shift of a body [m], shape (3,), that puts it on its rays; robust."""
    zero, one = np.zeros(len(body)), np.ones(len(body))
    x, y = rays.T
    A = np.concatenate([np.stack([one, zero, -x], axis=1), np.stack([zero, one, -y], axis=1)])
    b = np.concatenate([x * body[:, 2] - body[:, 0], y * body[:, 2] - body[:, 1]])
    weight = np.ones(len(b))
    shift = np.zeros(3)
    for _ in range(5):
        shift = np.linalg.lstsq(A * weight[:, None], b * weight, rcond=None)[0]
        weight = 1.0 / (1.0 + ((A @ shift - b) / 0.05) ** 2)
    return shift


def place(a: Track, b: Track, bodies_a: Array, bodies_b: Array, ahead_s: float) -> tuple[Array, float]:
    """Return the first transform from camera b to camera a, and the share of instants that agree with it."""
    rows, near = nearest(b, a.time_s - ahead_s)
    x, y = bodies_a, bodies_b[rows]
    both = np.isfinite(x).all(axis=2) & np.isfinite(y).all(axis=2) & near[:, None]
    frames = np.flatnonzero(both.sum(axis=1) >= _LEAST_JOINTS)
    if len(frames) == 0:
        return np.eye(4), 0.0
    turns = np.array([_turn(y[f], x[f], both[f]) for f in frames])
    rotation = _common(turns)
    far = _angles_deg(turns, rotation) > _FAR_DEG
    for f in frames[far]:  # left and right may be exchanged in one of them
        y[f] = y[f, OTHER_SIDE]
        both[f] &= both[f, OTHER_SIDE] & np.isfinite(y[f]).all(axis=1)
    turns = np.array([_turn(y[f], x[f], both[f]) for f in frames])
    rotation = _common(turns)
    fine = _angles_deg(turns, rotation) < _FAR_DEG
    frames = frames[fine]
    if len(frames) == 0:
        return np.eye(4), 0.0
    used = np.zeros(both.shape, dtype=np.bool_)
    used[frames] = both[frames]
    source, target = y[used], x[used]
    T = make_transform(rotation, np.median(target - source @ rotation.T, axis=0))
    for _ in range(10):
        rest = np.linalg.norm(transform_points(T, source) - target, axis=1)
        T = fit_rigid(source, target, 1.0 / (1.0 + (rest / _FAR_M) ** 2) ** 2)
    return T, float(fine.mean())


def _turn(source: Array, target: Array, used: Array) -> Array:
    return fit_rigid(source[used], target[used])[:3, :3]


def _common(turns: Array) -> Array:
    """Return the rotation that most of the rotations agree with."""
    mean = turns[int(np.median([_angles_deg(turns, one) for one in turns], axis=1).argmin())]
    for _ in range(10):
        weight = 1.0 / (1.0 + (_angles_deg(turns, mean) / 10.0) ** 2)
        u, _, vt = np.linalg.svd(np.einsum("f,fab->ab", weight, turns))
        mean = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return mean


def _angles_deg(turns: Array, rotation: Array) -> Array:
    cosine = (np.einsum("fab,ab->f", turns, rotation) - 1.0) / 2.0
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
