"""Cold start: the pose of an unknown person, from the points alone."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.seeing.fitting.chain import Pose, rotation_of
from studio.engine.seeing.fitting.cones import SHAPE, performer_of
from studio.engine.seeing.fitting.fit import BodyShape, Fit, Fitter, MeasuredPoints, Prior
from studio.engine.seeing.images.silhouette import Silhouette
from studio.engine.seeing.search.limbs import LimbSearch, resting
from studio.engine.seeing.search.unread import marked

Array = NDArray[np.float64]

_TRUNK_BAND = (0.45, 0.80)
_LIKELY_TRUNK = (0.36, 0.64)
"""The trunk's heights as shares of the highest point's, whether that is the head or a hand."""
_HEAD_REACH_M = 0.14
"""Largest horizontal distance of the head from the middle of the trunk [m]."""
_HALF_DEPTH_M, _HALF_BREADTH_M = 0.09, 0.16
"""Half depth and half breadth of an adult's trunk, with an arm beside it [m]."""
_FACING_AWAY_COST_M2 = 1.0
"""Penalty of a start that faces away from the cameras [m2], because people usually start facing them."""
_STRANGER = 0.6
"""A residual below this share of the known performer's shows that a new person is somebody else."""
BETTER = 0.6
"""A pose is better than another if its residual is below this share of the other's."""
_CAP_M = 0.15
_HEAD = 0.2
"""Logarithm of the cost factor of a start that faces the opposite way to a certain head direction."""

_STATURES_M = (0.86, 1.15, 1.50, 1.72)
_BY_STATURE = {"head": (1.5, 1.25, 1.07, 1.0), "leg": (0.88, 0.94, 1.0, 1.0), "arm": (0.93, 0.97, 1.0, 1.0)}
"""Children's scales relative to an adult's. The head is a fifth of the stature at two years, a sixth at six, a
seventh at twelve (Stratz, "Der Koerper des Kindes", 1909); the sitting height 0.58, 0.55 and 0.52 (Fredriks et al.,
"Nationwide age references for sitting height, leg length, and sitting height/height ratio", Arch Dis Child 90, 2005).
"""


@dataclass(frozen=True)
class Start:
    """A first pose, with its figure and its residual per point [m2], and poses that are about as good."""

    figure: BodyShape
    fit: Fit
    cost_m2: float
    others: tuple[Pose, ...] = ()


def height_of(points: MeasuredPoints) -> float:
    """Return the height of the person [m], within the human range, not counting raised arms."""
    heights = points.places[:, 2]
    top = float(np.percentile(heights, 99.5))
    trunk = (heights > _LIKELY_TRUNK[0] * top) & (heights < _LIKELY_TRUNK[1] * top)
    if trunk.any():
        middle = np.median(points.places[trunk, :2], axis=0)
        above = np.linalg.norm(points.places[:, :2] - middle, axis=1) < _HEAD_REACH_M
        if above.any():
            top = float(np.percentile(heights[above], 99.5))
    return float(np.clip(top + 0.005, 0.8, 2.2))


def shape_of_height(height_m: float) -> Array:
    """Return the usual shape for a height: small people are children, with a larger head and shorter legs."""
    shape = np.zeros(len(SHAPE))
    for name, scales in _BY_STATURE.items():
        shape[SHAPE.index(name)] = np.log(np.interp(height_m, _STATURES_M, scales))
    for _ in range(3):
        shape[0] += np.log(height_m / performer_of(shape).height_m)
    return shape


def yaws(points: MeasuredPoints) -> list[float]:
    """Return headings to try [rad], 0 = facing -y, towards the cameras first."""
    towards = points.views[:, :2].mean(axis=0)
    facing = float(np.arctan2(towards[0], -towards[1])) if np.hypot(*towards) > 0.2 else 0.0
    return [facing + turn for turn in np.radians([0.0, 45.0, -45.0, 90.0, -90.0, 180.0])]


def heading(pose: Pose) -> float:
    """Return a pose's heading [rad], 0 = facing -y."""
    return float(np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0]))


def standing(figure: BodyShape, points: MeasuredPoints, yaw: float, rest: Array) -> Pose:
    """Return the resting stance at the points' trunk."""
    heights = points.places[:, 2] / figure.offsets[0, 2] * 0.53
    trunk = (heights > _TRUNK_BAND[0]) & (heights < _TRUNK_BAND[1])
    some = points.places[trunk] if trunk.sum() > 20 else points.places
    into = points.views[trunk] if trunk.sum() > 20 else points.views
    towards = into.mean(axis=0)
    ahead = float(np.array([np.sin(yaw), -np.cos(yaw)]) @ towards[:2]) / max(
        float(np.hypot(*towards[:2])), 1e-9
    )
    half_m = np.hypot(_HALF_DEPTH_M * ahead, _HALF_BREADTH_M * np.sqrt(max(1.0 - ahead**2, 0.0)))
    middle = np.median(some, axis=0) - half_m * towards
    root = np.array([middle[0], middle[1], figure.offsets[0, 2]])
    return Pose(root, rotation_of(np.array([0.0, 0.0, yaw])), rest.copy())


def cost_of(
    search: LimbSearch,
    figure: BodyShape,
    pose: Pose,
    distance: Array,
    points: MeasuredPoints,
    silhouettes: tuple[Silhouette, ...],
) -> float:
    """Return the residual of a pose [m2]: clipped squared distances, and limbs in free space.

    `distance`: of each point to each part [m], shape (point_count, 5).
    """
    cost = unexplained(distance)
    none = MeasuredPoints.none()
    for limb in search.limbs:
        angles = pose.angles[limb.dofs][None]
        cost += float(search.cost(limb, figure, pose, angles, none, np.zeros(0), silhouettes)[0])
    return cost


def head_says(ahead: float) -> float:
    """Return the cost factor for a head that faces the same way as the body (1), or the opposite way (-1)."""
    return float(np.exp(-_HEAD * ahead))


def unexplained(distance: Array) -> float:
    """Return the sum of clipped squared distances [m2] of points to a body; `distance`: to each part [m], shape
    (point_count, 5).
    """
    capped = np.minimum(distance.min(axis=1), _CAP_M)
    return float(capped @ capped)


def cold_start(
    fitter: Fitter,
    search: LimbSearch,
    figure: BodyShape,
    points: MeasuredPoints,
    silhouettes: tuple[Silhouette, ...],
    posture: Array,
    headings: list[float],
    ahead: Callable[[BodyShape, Pose], float],
) -> Start:
    """Return the best fit from several starting headings, with limbs searched in each.

    `ahead`: agreement of head and body; see `Heads.ahead`.
    """
    starts = []
    for yaw in headings:
        pose = standing(figure, points, yaw, fitter.limits.rest)
        loose = resting(Prior(pose, np.full(len(posture), 1.0), posture), pose, search.limbs, silhouettes)
        fit = fitter.fit(figure, pose, points, silhouettes, loose, iterations=4, reach=0.20)
        for _ in range(2):
            pose = fit.pose
            for limb in search.limbs:
                pose, _ = search.search(limb, figure, pose, fit.distance, points, silhouettes, loose)
            fit = fitter.fit(figure, pose, points, silhouettes, loose, iterations=4, reach=0.12)
        cost = cost_of(search, figure, fit.pose, fit.distance, points, silhouettes)
        cost *= head_says(ahead(figure, fit.pose))
        if np.cos(heading(fit.pose) - headings[0]) < -0.3:
            cost += _FACING_AWAY_COST_M2 * len(points.places) / 1000.0
        starts.append(Start(figure, fit, cost))
    best, *others = sorted(starts, key=lambda start: start.cost_m2)
    as_good = (other.fit.pose for other in others if best.cost_m2 > BETTER * other.cost_m2)
    return replace(best, others=tuple(as_good))


def marked_standing(
    fitter: Fitter, points: MeasuredPoints, silhouettes: tuple[Silhouette, ...]
) -> tuple[Silhouette, ...]:
    """Return the silhouettes with the unread places of a usual body that stands at the points; see `marked`."""
    figure = BodyShape.of(shape_of_height(height_of(points)))
    stance = standing(figure, points, yaws(points)[0], fitter.limits.rest)
    return marked(fitter, figure, stance, silhouettes, points)


def best_start(
    fitter: Fitter,
    search: LimbSearch,
    known: BodyShape | None,
    points: MeasuredPoints,
    silhouettes: tuple[Silhouette, ...],
    posture: Array,
    ahead: Callable[[BodyShape, Pose], float],
) -> Start:
    """Return the start of the known performer's figure, or of a usual figure of the points' height if that fits much
    better; arguments as for `cold_start`.
    """
    usual = BodyShape.of(shape_of_height(height_of(points)))
    figures = [usual] if known is None else [known, usual]
    starts = [
        cold_start(fitter, search, figure, points, silhouettes, posture, yaws(points), ahead)
        for figure in figures
    ]
    best = min(starts, key=lambda start: start.cost_m2)
    return starts[0] if starts[0].cost_m2 * _STRANGER < best.cost_m2 else best
