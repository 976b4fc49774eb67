"""A prop over a take: found once, then followed forwards and backwards from frame to frame.

Constant velocities predict the next instant, and the fit corrects the prediction. A prop of which too little is seen
is lost and searched for again. Rotations that cannot be seen, those of a ball and of a stick about itself, continue
without a jump.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import quaternions, rotation_between
from studio.engine.base.quaternions import continuous_signs, normalized
from studio.engine.model.rigid_body import RigidShape
from studio.engine.seeing.props.find import find_prop
from studio.engine.seeing.props.fit import Fitted, PropFit, PropPose
from studio.engine.seeing.props.sight import SeenImage

Array = NDArray[np.float64]
Look = Callable[[int], Sequence[SeenImage]]
"""Returns what cameras see at an instant, by the instant's index."""

_ABOUT_M = 0.15
_COAST_S, _AGAIN_S, _BEGIN_S = 0.15, 0.2, 0.5
_KEPT = 0.5
"""Share of a velocity's change that is adopted."""

_FASTEST_M_S, _FASTEST_RAD_S = 12.0, 40.0
_LEAST_S, _LOST = 0.2, 2
"""Shortest piece of motion that is kept [s]; largest step between instants within a piece."""

_SMOOTH = 7


@dataclass(frozen=True)
class FollowedProp:
    """The motion of a prop where it was seen.

    Attributes:
        time_s: stage time [s], shape (n,).
        places_m: of its origin on the stage [m], shape (n, 3).
        rotations_wxyz: shape (n, 4).
        looked: number of instants at which the prop was searched for.
    """

    time_s: Array
    places_m: Array
    rotations_wxyz: Array
    looked: int


def follow_prop(
    time_s: Array,
    look: Look,
    shape: RigidShape,
    *,
    start: tuple[float, Array] | None = None,
    progress: Callable[[float], None] | None = None,
) -> FollowedProp | None:
    """Return a prop's motion; None where it is not found.

    Args:
        time_s: stage times of the instants [s], shape (n,), increasing.
        look: see `Look`.
        shape: of the prop.
        start: a stage time [s] and the prop's place [m] then; None = it is searched for.
        progress: receives the share done.
    """
    fit = PropFit(shape)
    begun = _begin(time_s, look, fit, start)
    if begun is None:
        return None
    first, found = begun
    poses: dict[int, PropPose] = {first: found.pose}
    ways = (range(first + 1, len(time_s)), range(first - 1, -1, -1))
    done = 0
    for way in ways:
        follower = _Follower(fit, time_s[first], found.pose)
        for k in way:
            pose = follower.step(float(time_s[k]), look(k))
            if pose is not None:
                poses[k] = pose
            done += 1
            if progress is not None:
                progress(done / max(len(time_s) - 1, 1))
    return _smooth(time_s, poses, shape)


def _begin(
    time_s: Array, look: Look, fit: PropFit, start: tuple[float, Array] | None
) -> tuple[int, Fitted] | None:
    if start is not None:
        first = int(np.abs(time_s - start[0]).argmin())
        found = find_prop(look(first), fit, start[1])
        return None if found is None else (first, found)
    step = max(1, round(_BEGIN_S / float(np.median(np.diff(time_s))))) if len(time_s) > 1 else 1
    best: tuple[int, Fitted] | None = None
    good = 0
    for k in range(0, len(time_s), step):
        found = find_prop(look(k), fit)
        if found is None:
            continue
        good += 1
        if best is None or found.worth > best[1].worth:
            best = k, found
        if good >= 3:
            break
    return best


class _Follower:
    """Follows a prop through the instants in one direction."""

    def __init__(self, fit: PropFit, time_s: float, pose: PropPose) -> None:
        self._fit = fit
        self._seen_s, self._pose = time_s, pose
        self._looked_s = time_s

    def step(self, time_s: float, images: Sequence[SeenImage]) -> PropPose | None:
        """Return the prop at the next instant; None where it is not seen."""
        dt = time_s - self._seen_s
        if abs(dt) <= _COAST_S:
            guess = self._pose.after(dt)
            longer = max(1.0, abs(dt) * 30.0)
            found = self._fit.fit(images, guess, 0.03 * longer, 0.2 * longer)
            if found.doubtful:
                found = self._other(images, guess, found)
            if found.holds and self._near(found.pose, guess, longer):
                return self._take(time_s, found.pose, guess, dt)
            return None
        if abs(time_s - self._looked_s) < _AGAIN_S:
            return None
        self._looked_s = time_s
        again = find_prop(images, self._fit)
        if again is None:
            return None
        self._seen_s = time_s
        self._pose = PropPose.still(again.pose.place_m, self._like_before(again.pose.turn))
        return self._pose

    def _other(self, images: Sequence[SeenImage], guess: PropPose, found: Fitted) -> Fitted:
        """Return another fit near the guess if it is better than `found`, the fit from the guess; else `found`."""
        other = find_prop(images, self._fit, guess.place_m, within_m=_ABOUT_M)
        if other is None or other.worth <= max(found.worth, 0.0) * 1.1:
            return found
        pose = replace(guess, place_m=other.pose.place_m, turn=self._like_before(other.pose.turn))
        return self._fit.fit(images, pose)

    def _near(self, pose: PropPose, guess: PropPose, longer: float) -> bool:
        return bool(np.linalg.norm(pose.place_m - guess.place_m) < 0.15 * longer)

    def _take(self, time_s: float, pose: PropPose, guess: PropPose, dt: float) -> PropPose:
        """Adopt a pose, and update the velocities with it."""
        speed = guess.speed_m_s + _KEPT * (pose.place_m - guess.place_m) / dt
        turned = Rotation.from_matrix(pose.turn @ guess.turn.T, assume_valid=True).as_rotvec()
        spin = guess.spin_rad_s + _KEPT * turned / dt
        self._pose = PropPose(
            pose.place_m, pose.turn, _at_most(speed, _FASTEST_M_S), _at_most(spin, _FASTEST_RAD_S)
        )
        self._seen_s = self._looked_s = time_s
        return self._pose

    def _like_before(self, turn: Array) -> Array:
        """Return the rotation nearest to the last one among those that look the same."""
        shape, before = self._fit.shape, self._pose.turn
        if shape.kind == "sphere":
            return before
        if shape.kind == "cylinder":
            axis = "xyz".index(shape.axis)
            was, now = before[:, axis], turn[:, axis]
            return rotation_between(was, now if was @ now > 0 else -now) @ before
        alike = [turn @ one for one in _same_boxes(shape.edges_m)]
        return max(alike, key=lambda one: float(np.trace(before.T @ one)))


def _same_boxes(edges_m: Array) -> list[Array]:
    """Return the rotations after which a box looks the same."""
    found = []
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (1, 0, 2), (0, 2, 1), (2, 1, 0)):
        if np.abs(edges_m[list(order)] - edges_m).max() > 1e-6:
            continue
        for signs in ((x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)):
            turn = np.eye(3)[:, list(order)] * signs
            if np.linalg.det(turn) > 0:
                found.append(turn)
    return found


def _at_most(vector: Array, most: float) -> Array:
    return vector * min(1.0, most / max(float(np.linalg.norm(vector)), 1e-9))


def _smooth(time_s: Array, poses: dict[int, PropPose], shape: RigidShape) -> FollowedProp | None:
    """Return the motion smoothed by a parabola, without pieces that are too short."""
    numbers = np.array(sorted(poses))
    places = np.array([poses[k].place_m for k in numbers.tolist()])
    turns = continuous_signs(quaternions(np.array([poses[k].turn for k in numbers.tolist()])))
    times = time_s[numbers]
    cuts = np.flatnonzero(np.diff(numbers) > _LOST) + 1
    kept = []
    for piece in np.split(np.arange(len(numbers)), cuts):
        if times[piece[-1]] - times[piece[0]] < _LEAST_S:
            continue
        kept.append(piece)
        values = np.concatenate([places[piece], turns[piece]], axis=1)
        smoothed = _parabola(times[piece], values)
        places[piece], turns[piece] = smoothed[:, :3], normalized(smoothed[:, 3:])
    if not kept:
        return None
    chosen = np.concatenate(kept)
    return FollowedProp(times[chosen], places[chosen], turns[chosen], len(time_s))


def _parabola(time_s: Array, values: Array) -> Array:
    """Return values smoothed by a parabola fitted to the `_SMOOTH` instants around each."""
    out = values.copy()
    half = _SMOOTH // 2
    for k in range(half, len(time_s) - half):
        rows = slice(k - half, k + half + 1)
        t = time_s[rows] - time_s[k]
        A = np.stack([np.ones_like(t), t, t * t], axis=1)
        out[k] = np.linalg.lstsq(A, values[rows], rcond=None)[0][0]
    return out
