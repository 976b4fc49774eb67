"""Keeps performers apart from one another, and makes hands meet that hold each other.

The surfaces are those of `body_contact`. A performer moves half of the way out of another, whose place is that of the
last step; the other moves the other half in their own step (the Jacobi method: all move at once).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from studio.engine.base.geometry import nearest_on_segments
from studio.engine.model.joints import INDEX
from studio.engine.whole_take.finish.contact.body_contact import (
    BELIEVED_M,
    GIVES_M,
    NEAR_M,
    SIGMA_M,
    SURFACES,
)
from studio.engine.whole_take.finish.trajectory import Kinematics

NEAR_HIPS_M = 1.6
"""Distance of the hips [m] beyond which two performers do not touch."""

WITHIN_NS = 10_000_000
"""Largest time between frames of two performers that count as simultaneous."""

HALF = 0.5

HOLDS_M = 0.12
HOLDS_S = 0.8
OVER_S = 0.3
"""Hands hold each other where they stay within the first distance for the second time; distances are medians over the
third. Blows and passing hands are shorter. Hands of finished takes are 3 to 5 cm from the true ones.
"""

MEET_SIGMA_M = 0.010

_SIDES = ("left", "right")
_HANDS = np.array([[INDEX[f"{side}_wrist"], INDEX[f"{side}_hand"]] for side in _SIDES])
_ENDS = np.array([[INDEX[start], INDEX[end]] for start, end, _, _ in SURFACES.values()])
_RADII = np.array([radii for _, _, *radii in SURFACES.values()])
_OWN, _THEIRS = (index.ravel() for index in np.indices((len(_ENDS), len(_ENDS))))
_HAND_PARTS = np.array([list(SURFACES).index(f"{side}_hand") for side in _SIDES])
_HIPS = INDEX["hips"]


@dataclass(frozen=True)
class Surfaces:
    """A performer's surfaces over a take.

    Attributes:
        times_ns: stage times of the frames, shape (frame_count,).
        sites: canonical joints [m], shape (frame_count, 21, 3); NaN = not there.
        height_m: stature.
    """

    times_ns: NDArray[np.int64]
    sites: NDArray[np.float64]
    height_m: float

    def at(self, times_ns: NDArray[np.int64], within_ns: int) -> NDArray[np.float64]:
        """Return the joints at other times, shape (time_count, 21, 3); NaN = no frame within `within_ns`."""
        after = np.clip(np.searchsorted(self.times_ns, times_ns), 0, len(self.times_ns) - 1)
        before = np.maximum(after - 1, 0)
        nearer = times_ns - self.times_ns[before] < self.times_ns[after] - times_ns
        place = np.where(nearer, before, after)
        out = self.sites[place]
        out[np.abs(self.times_ns[place] - times_ns) > within_ns] = np.nan
        return out


@dataclass(frozen=True)
class OtherPerformer:
    """Another performer, at the times of one performer's frames.

    Attributes:
        sites: their joints [m], shape (frame_count, 21, 3); NaN = not there.
        height_m: their stature.
        holds: whether the performer's left and right hand hold their left and right one, shape (frame_count, 2, 2).
    """

    sites: NDArray[np.float64]
    height_m: float
    holds: NDArray[np.bool_]

    def part(self, frames: slice) -> "OtherPerformer":
        """Return the other performer in these frames."""
        return OtherPerformer(self.sites[frames], self.height_m, self.holds[frames])

    def near(self, q: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return the frames in which they may touch the performer of configurations, shape (frame_count, nq)."""
        return np.linalg.norm(q[:, :3] - self.sites[:, _HIPS], axis=1) < NEAR_HIPS_M

    def is_near(self, q: NDArray[np.float64]) -> bool:
        """Return whether they may touch the performer in any frame."""
        return bool(self.near(q).any())


def meet(own: Surfaces, other: Surfaces, dt: float) -> OtherPerformer:
    """Return another performer at the times of this one's frames, `dt` apart [s]."""
    sites = other.at(own.times_ns, round(0.5e9 * dt))
    return OtherPerformer(sites, other.height_m, holding(own.sites, sites, dt))


def holding(own: NDArray[np.float64], theirs: NDArray[np.float64], dt: float) -> NDArray[np.bool_]:
    """Return which hands hold each other, shape (frame_count, 2, 2), of joints, shape (frame_count, 21, 3)."""
    over = 2 * round(0.5 * OVER_S / dt) + 1
    near = median_filter(hands_apart_m(own, theirs), (over, 1, 1), mode="nearest") < HOLDS_M
    out = np.zeros_like(near)
    for mine, other in np.ndindex(2, 2):
        steps = np.diff(near[:, mine, other].astype(int), prepend=0, append=0)
        for first, end in np.flatnonzero(steps).reshape(-1, 2):
            out[first:end, mine, other] = end - first >= HOLDS_S / dt
    return out


def hands_apart_m(own: NDArray[np.float64], theirs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distances of hands [m], shape (frame_count, 2, 2), of joints, shape (frame_count, 21, 3); infinite =
    unknown."""
    a, b = own[:, _HANDS][:, :, None], theirs[:, _HANDS][:, None]
    way = nearest_on_segments(a[..., 0, :], a[..., 1, :], b[..., 0, :], b[..., 1, :])[2]
    apart = np.linalg.norm(way, axis=3)
    return np.where(np.isfinite(apart), apart, np.inf)


def overlap_m(own: Surfaces, other: Surfaces) -> NDArray[np.float64]:
    """Return the depth of two performers' overlap in each frame of the first one [m], shape (frame_count,)."""
    sites = other.at(own.times_ns, WITHIN_NS)
    _, _, way, reach = _between(own.sites, sites, own.height_m, other.height_m)
    deep = reach - np.linalg.norm(way, axis=2)
    return np.maximum(np.where(np.isfinite(deep), deep, 0.0).max(axis=1), 0.0)


class OtherBodies:
    """Rows of finishing's problem that push a performer out of the others, and bring held hands together."""

    def __init__(self, height_m: float) -> None:
        """Prepare for a performer of this stature."""
        self._height_m = height_m

    def rows(
        self, q: NDArray[np.float64], kinematics: Kinematics, other: OtherPerformer
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Return rows as `BodyContact.rows` does.

        Args:
            q: the performer's configurations, shape (frame_count, nq).
            kinematics: of the performer.
            other: in the same frames.
        """
        near = np.flatnonzero(other.near(q))
        if len(near) == 0:
            return near, np.zeros((0, q.shape[1] - 1)), np.zeros(0)
        sites, jacobians = kinematics.linearised(q[near])
        part = OtherPerformer(other.sites[near], other.height_m, other.holds[near])
        pushed, held = self._pushed(sites, jacobians, part), self._held(sites, jacobians, part)
        frames, rows = np.concatenate([pushed[0], held[0]]), np.concatenate([pushed[1], held[1]])
        return near[frames], rows, np.concatenate([pushed[2], held[2]])

    def _pushed(
        self, sites: NDArray[np.float64], jacobians: NDArray[np.float64], other: OtherPerformer
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        own, _, way, reach = _between(sites, other.sites, self._height_m, other.height_m)
        distance = np.linalg.norm(way, axis=2)
        deep = reach - GIVES_M - distance
        frames, pairs = np.nonzero((deep > -NEAR_M) & (distance > 1e-6))
        too_deep = np.maximum(deep[frames, pairs], 0.0)
        root_weight = 1.0 / (1.0 + (too_deep / BELIEVED_M) ** 2) / SIGMA_M
        rows = _moving(
            jacobians, frames, _ENDS[_OWN[pairs]], own[frames, pairs],
            way[frames, pairs] / distance[frames, pairs, None],
        )  # fmt: skip
        return frames, rows * root_weight[:, None], HALF * too_deep * root_weight

    def _held(
        self, sites: NDArray[np.float64], jacobians: NDArray[np.float64], other: OtherPerformer
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        frames, mine, theirs = np.nonzero(other.holds)
        pairs = _HAND_PARTS[mine] * len(_ENDS) + _HAND_PARTS[theirs]
        own, _, way, reach = _between(sites, other.sites, self._height_m, other.height_m)
        own, way, reach = own[frames, pairs], way[frames, pairs], reach[frames, pairs]
        distance = np.maximum(np.linalg.norm(way, axis=1), 1e-6)
        too_far = np.maximum(distance + GIVES_M - reach, 0.0)
        rows = _moving(jacobians, frames, _ENDS[_OWN[pairs]], own, way / distance[:, None])
        rows *= (too_far > 0.0)[:, None]
        return frames, rows / MEET_SIGMA_M, -HALF * too_far / MEET_SIGMA_M


def _between(
    sites: NDArray[np.float64], others: NDArray[np.float64], height_m: float, other_height_m: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return, for every pair of parts, the nearest points of the own and the other one as shares of their bones, the
    vector from the other to the own one [m], and the sum of the radii there [m]; leading shape (frame_count,
    pair_count)."""
    a, b = sites[:, _ENDS[_OWN]], others[:, _ENDS[_THEIRS]]
    own, theirs, way = nearest_on_segments(a[:, :, 0], a[:, :, 1], b[:, :, 0], b[:, :, 1])
    radii, other_radii = height_m * _RADII[_OWN], other_height_m * _RADII[_THEIRS]
    reach = radii[:, 0] + own * (radii[:, 1] - radii[:, 0])
    reach = reach + other_radii[:, 0] + theirs * (other_radii[:, 1] - other_radii[:, 0])
    return own, theirs, way, reach


def _moving(
    jacobians: NDArray[np.float64],
    frames: NDArray[np.int64],
    ends: NDArray[np.int64],
    share: NDArray[np.float64],
    way: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the derivatives of points on bones, along directions, by the degrees of freedom, shape (row_count,
    nv)."""
    j = jacobians.reshape(len(jacobians), -1, 3, jacobians.shape[2])[frames[:, None], ends]
    shares = np.stack([1.0 - share, share], axis=1)
    return np.asarray(np.einsum("re,ra,rean->rn", shares, way, j), dtype=np.float64)
