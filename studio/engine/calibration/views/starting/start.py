"""First places of the cameras: guessed bodies are placed in front of each camera, then aligned."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import fit_rigid, make_transform, rotation_between
from studio.engine.calibration.views.seen.bodies import Array
from studio.engine.calibration.views.seen.tracks import ViewTrack, nearest
from studio.engine.calibration.views.seen.view import NUMBER
from studio.engine.model.triangulation.guess import shift_equations

_LEAST_JOINTS = 8
_FAR_M = 0.25
_TURNS = 24


def bodies(track: ViewTrack) -> Array:
    """Return the guessed bodies where the picture shows them [m], in the camera's frame, shape (frame_count, 17, 3).

    NaN where too little is seen. The guess lies along the line of sight to the body.
    """
    rays = track.points / track.focal
    out = np.full(track.world_m.shape, np.nan)
    for f in np.flatnonzero(track.seen.sum(axis=1) >= _LEAST_JOINTS):
        seen = track.seen[f]
        middle = np.append(np.median(rays[f, seen], axis=0), 1.0)
        body = (
            track.world_m[f, seen]
            @ rotation_between(np.array([0.0, 0.0, 1.0]), middle / np.linalg.norm(middle)).T
        )
        out[f, seen] = body + _place(body, rays[f, seen])
    out[~(out[..., 2] > 0.1)] = np.nan
    return out


def _place(body: Array, rays: Array) -> Array:
    """Return the shift of a body [m], shape (3,), that puts it on its rays; robust."""
    A, b = shift_equations(body, rays)
    weight = np.ones(len(b))
    shift: Array = np.zeros(3)
    for _ in range(5):
        shift[:] = np.linalg.lstsq(A * weight[:, None], b * weight, rcond=None)[0]
        weight = 1.0 / (1.0 + ((A @ shift - b) / 0.05) ** 2)
    return shift


def places(a: ViewTrack, b: ViewTrack, bodies_a: Array, bodies_b: Array, ahead_s: float) -> list[Array]:
    """Return candidate transforms from camera b to camera a, the likeliest first.

    The guesses of two cameras that face each other may be turned by half a circle, or have left and right swapped.
    The candidates therefore include turns about the upright body as well as the turn that most instants support.
    """
    rows, near = nearest(b, a.time_s - ahead_s)
    x, y = bodies_a, bodies_b[rows]
    both = np.isfinite(x).all(axis=2) & np.isfinite(y).all(axis=2) & near[:, None]
    frames = np.flatnonzero(both.sum(axis=1) >= _LEAST_JOINTS)
    if len(frames) == 0:
        return []
    turns = np.array([_turn(y[f], x[f], both[f]) for f in frames])
    most, up_a, up_b = _common(turns), _upright(bodies_a), _upright(bodies_b)
    level = rotation_between(up_b, up_a)
    tried = [most] + [
        Rotation.from_rotvec(up_a * angle).as_matrix() @ level
        for angle in np.arange(_TURNS) * 2 * np.pi / _TURNS
    ]
    used = np.zeros(both.shape, dtype=np.bool_)
    used[frames] = both[frames]
    return [_joined(turn, y[used], x[used]) for turn in tried]


def _joined(turn: Array, source: Array, target: Array) -> Array:
    """Return the transform with a known rotation that best aligns points, robustly."""
    shift = np.median(target - source @ turn.T, axis=0)
    for _ in range(10):
        rest = target - source @ turn.T - shift
        weight = 1.0 / (1.0 + (rest**2).sum(axis=1) / _FAR_M**2) ** 2
        shift = shift + weight @ rest / weight.sum()
    return make_transform(turn, shift)


def _upright(bodies: Array) -> Array:
    """Return the mean direction from the feet to the shoulders, shape (3,)."""
    top = bodies[:, [NUMBER["left_shoulder"], NUMBER["right_shoulder"]]].mean(axis=1)
    way = top - bodies[:, [NUMBER["left_hip"], NUMBER["right_hip"]]].mean(axis=1)
    way = way[np.isfinite(way).all(axis=1)]
    if len(way) == 0:
        return np.array([0.0, -1.0, 0.0])
    mean = np.median(way / np.linalg.norm(way, axis=1, keepdims=True), axis=0)
    return mean / np.linalg.norm(mean)


def _turn(source: Array, target: Array, used: NDArray[np.bool_]) -> Array:
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
