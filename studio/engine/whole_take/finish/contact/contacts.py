"""Stances of ankles and toes, with times and places, found after a first smooth pass over the take."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_opening, binary_propagation, gaussian_filter1d

from studio.engine.base.arrays import runs
from studio.engine.model.joints import INDEX
from studio.engine.solve.completion.floor import LEAST_HEIGHT
from studio.engine.whole_take.finish.contact.places import CHANGE_M2_S, places_of

JOINTS = tuple(INDEX[name] for name in ("left_ankle", "left_toe", "right_ankle", "right_toe"))
_ANKLES, _TOES = [0, 2], [1, 3]  # of `JOINTS`

STAND_SPEED_M_S = 0.5
STAND_HEIGHT_M = 0.04
"""A joint stands below this speed and at most this far above its standing height."""

LIFTED_M = 0.06
"""Between two stances, a joint that stays slow and below this height stands on, because noise lifts a toe by
centimetres.
"""

SMOOTHING_S = 0.05
"""Standard deviation of the Gaussian that smooths a path before its speed is taken, because noise moves a standing
foot."""

MIN_STAND_S = 0.10
MAX_GAP_S = 0.08

EASE_S = 0.05
"""Blend time of a hold and of a release."""

FLAT_M = 0.025
"""A foot is flat if its ankle's height over its toe differs from that at rest by less than this."""

LEAST_OVER_GIVEN = 0.75
"""Lowest height of a joint over a given floor as a share of that at rest: a foot tipped by 40 degrees."""

SURE_M = 0.012
MOVED_M = 0.024
MAX_SUNK_M = 0.08
"""Height of the floor by the feet. Below the first value, the calibrated floor is kept; above the second, the feet's
is used; between them the two are blended. The third is the largest correction.
"""


@dataclass(frozen=True)
class Contacts:
    """Standing joints over a take, columns as in `JOINTS`.

    Attributes:
        hold: 0 = free, 1 = stands, shape (frame_count, 4).
        place_m: place of each stance [m], shape (frame_count, 4, 3); the joint's own path where it does not stand.
        floor_m: height of the floor under the take.
        least_m: lowest allowed height of each joint [m], shape (frame_count, 4).
        change_m2_s: cost of a change of place (`places`).
    """

    hold: NDArray[np.float64]
    place_m: NDArray[np.float64]
    floor_m: float
    least_m: NDArray[np.float64]
    change_m2_s: float = CHANGE_M2_S

    def part(self, rows: slice) -> "Contacts":
        """The contacts of some frames."""
        return replace(self, hold=self.hold[rows], place_m=self.place_m[rows], least_m=self.least_m[rows])

    def with_rows(self, rows: NDArray[np.bool_], other: "Contacts") -> "Contacts":
        """The contacts, with some frames, flags of shape (frame_count,), taken from others of the same take."""
        hold = np.where(rows[:, None], other.hold, self.hold)
        least_m = np.where(rows[:, None], other.least_m, self.least_m)
        place_m = np.where(rows[:, None, None], other.place_m, self.place_m)
        return replace(self, hold=hold, place_m=place_m, least_m=least_m)

    def at_places_of(self, feet: NDArray[np.float64], pieces: list[tuple[int, int]], dt: float) -> "Contacts":
        """The same stances at the places of another trajectory's feet; arguments as of `find_contacts`.

        Ankle and toe have separate places, which may be further apart than the foot is long. Where both are held, the
        solve puts them in between. These places then hold the toe when its heel rises.
        """
        place = feet.copy()
        for begin, end in pieces:
            for column in range(len(JOINTS)):
                for first, last in runs(self.hold[begin:end, column] > 0.0):
                    rows = slice(begin + first, begin + last)
                    place[rows, column] = places_of(feet[rows, column], dt, change_m2_s=self.change_m2_s)
        np.maximum(place[:, :, 2], self.least_m, out=place[:, :, 2])
        return replace(self, place_m=place)

    def as_asked(
        self,
        asked: NDArray[np.int8],
        feet: NDArray[np.float64],
        pieces: list[tuple[int, int]],
        dt: float,
        rest_heights_m: NDArray[np.float64],
    ) -> "Contacts":
        """The stances with those that an operator added (1) or took away (-1), shape (frame_count, 4); the others are
        arguments of `find_contacts`. An added stance is on the floor."""
        hold = np.where(asked < 0, 0.0, self.hold)
        for begin, end in pieces:
            for column in range(len(JOINTS)):
                for first, last in runs(asked[begin:end, column] != 0):
                    rows = slice(begin + first, begin + last)
                    free = first > 0, begin + last < end
                    eased = _eased(last - first, dt, free)
                    told = np.where(asked[rows, column] > 0, eased, 1.0 - eased)
                    hold[rows, column] = np.where(
                        asked[rows, column] > 0,
                        np.maximum(self.hold[rows, column], told),
                        np.minimum(self.hold[rows, column], told),
                    )
        on_floor = feet.copy()
        height = self.floor_m + rest_heights_m
        on_floor[:, :, 2] = np.where(asked > 0, height, feet[:, :, 2])
        return replace(self, hold=hold).at_places_of(on_floor, pieces, dt)


def find_contacts(
    feet: NDArray[np.float64],
    pieces: list[tuple[int, int]],
    dt: float,
    rest_heights_m: NDArray[np.float64],
    *,
    floor_given: bool = False,
    wander: float = 1.0,
) -> Contacts:
    """Return the stances with their times and places, and the floor.

    Args:
        feet: `JOINTS` of a smooth trajectory [m], shape (frame_count, 4, 3).
        pieces: begin and end of each part of the take without a gap [frames].
        dt: time between frames [s].
        rest_heights_m: heights of `JOINTS` in the T-pose [m], shape (4,).
        floor_given: the floor is at 0, and the heights are those of standing feet.
        wander: variance of the trajectory's slow errors relative to that with depth cameras; the smaller, the cheaper
            a change of place.
    """
    slow = np.concatenate([_speed(feet[begin:end], dt) < STAND_SPEED_M_S for begin, end in pieces])
    height = np.array([_standing_height(feet[slow[:, k], k, 2]) for k in range(len(JOINTS))])
    above = np.abs(feet[:, :, 2] - height)
    standing = slow & (above < STAND_HEIGHT_M)
    still = slow & (above < LIFTED_M)
    gap, least = (np.ones((max(1, round(s / dt)), 1), dtype=bool) for s in (MAX_GAP_S, MIN_STAND_S))
    for begin, end in pieces:
        standing[begin:end] = _steady(_through(standing[begin:end], still[begin:end]), gap, least)
    floor_m = 0.0 if floor_given else _floor_m(feet, standing, rest_heights_m)
    least_m = floor_m + (LEAST_OVER_GIVEN if floor_given else LEAST_HEIGHT) * rest_heights_m
    hold = np.zeros(standing.shape)
    for begin, end in pieces:
        for column in range(len(JOINTS)):
            for first, last in runs(standing[begin:end, column]):
                free = first > 0, begin + last < end
                hold[begin + first : begin + last, column] = _eased(last - first, dt, free)
    least_m = np.tile(least_m, (len(feet), 1))
    return Contacts(hold, feet, floor_m, least_m, wander * CHANGE_M2_S).at_places_of(feet, pieces, dt)


def lying(
    path: NDArray[np.float64], holds: NDArray[np.bool_], pieces: list[tuple[int, int]], dt: float
) -> NDArray[np.float64]:
    """Return the place of a holding joint [m], shape (frame_count, 2), from its path, shape (frame_count, 3)."""
    out = path[:, :2].copy()
    for begin, end in pieces:
        for first, last in runs(holds[begin:end]):
            rows = slice(begin + first, begin + last)
            out[rows] = places_of(path[rows], dt)[:, :2]
    return out


def wander_of(alike: float) -> float:
    """Return the size of a trajectory's slow errors, 0..1, from the correlation of noise (`NoiseScale.alike`).

    Depth cameras have a correlation of 0.8 to 1; noise with at least half of it counts as theirs.
    """
    return min(2.0 * alike, 1.0)


def _speed(feet: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    """Speed of the smoothed paths [m/s], shape (frame_count, 4)."""
    if len(feet) < 2:
        return np.zeros(feet.shape[:2])
    smooth = gaussian_filter1d(feet, SMOOTHING_S / dt, axis=0, mode="nearest")
    return np.linalg.norm(np.gradient(smooth, dt, axis=0), axis=2)


def _through(standing: NDArray[np.bool_], still: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Stances extended over still frames: between two stances if all are still; for a toe also before and after."""
    out = standing.copy()
    for column in range(standing.shape[1]):
        if column in _TOES:
            out[:, column] = binary_propagation(standing[:, column], mask=still[:, column])
            continue
        for first, last in runs(~standing[:, column]):
            between = first > 0 and last < len(standing)
            out[first:last, column] = between and still[first:last, column].all()
    return out


def _steady(
    standing: NDArray[np.bool_], gap: NDArray[np.bool_], least: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Stances without short gaps and without short stances; a stance at an end of the take counts as continuing."""
    beyond = max(len(gap), len(least))
    padded = np.pad(standing, ((beyond, beyond), (0, 0)), mode="edge")
    return binary_opening(binary_closing(padded, gap), least)[beyond:-beyond]


def _standing_height(heights: NDArray[np.float64]) -> float:
    """The median of the lower half of a slow joint's heights; infinite without any."""
    if len(heights) == 0:
        return float("inf")
    low = np.sort(heights)[: max(1, len(heights) // 2)]
    return float(np.median(low))


def _eased(count: int, dt: float, free: tuple[bool, bool]) -> NDArray[np.float64]:
    """Hold over a run of frames: blended in, 1, and blended out; blended only where the joint is `free` before or
    after."""
    from_begin, to_end = np.arange(count) + 1.0, np.arange(count)[::-1] + 1.0
    to_edge = np.minimum(from_begin if free[0] else np.inf, to_end if free[1] else np.inf)
    return np.minimum(np.broadcast_to(to_edge, count) * dt / EASE_S, 1.0)


def _floor_m(
    feet: NDArray[np.float64], standing: NDArray[np.bool_], rest_heights_m: NDArray[np.float64]
) -> float:
    """Height of the floor at which standing feet have their resting heights [m].

    The floor was calibrated from another walk and may be some centimetres off; the take's own standing feet are more
    accurate. A foot on its toes or on a box may be above its resting height, but none stands below it: feet above
    count only where most are flat. Differences below `SURE_M` are ignored, because joints differ from the bones' true
    ends by as much.
    """
    above = feet[:, :, 2] - rest_heights_m
    stands = standing[:, _ANKLES] & standing[:, _TOES]
    foot = 0.5 * (above[:, _ANKLES] + above[:, _TOES])[stands]
    flat = (np.abs(above[:, _ANKLES] - above[:, _TOES]) < FLAT_M)[stands]
    middle = float(np.median(foot)) if len(foot) else 0.0
    if middle > 0.0 and flat.mean() < 0.5:
        return 0.0
    share = np.interp(abs(middle), [SURE_M, MOVED_M], [0.0, 1.0])
    return float(np.clip(share * middle, -MAX_SUNK_M, MAX_SUNK_M))
