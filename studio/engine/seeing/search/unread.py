"""Legs that no camera reads: out of range, in dark clothes, behind furniture, beyond the picture's edge.

For them, cells without readings are not free space. The legs hang at rest until a camera reads them, and their joints
are doubted.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.human.humanoid import BODY_JOINTS
from studio.engine.seeing.fitting.chain import Pose
from studio.engine.seeing.fitting.cones import PARTS, part_of
from studio.engine.seeing.fitting.fit import (
    REACH_M,
    BodyShape,
    Fit,
    Fitter,
    MeasuredPoints,
    sample_places,
)
from studio.engine.seeing.images.silhouette import (
    COVERED,
    OUTSIDE,
    SEEN,
    UNREAD,
    Silhouette,
    nearest_cells,
    shown,
    unread_cells,
    unread_column,
)
from studio.engine.seeing.search.bones import SURE, added_by, log_likelihoods

Array = NDArray[np.float64]

_UNREAD_SHARE = 0.3
"""A leg of which more than this share is unread is unread from its first unread place to its end."""
_MARGIN = 60
"""Margin around the performer in which the nearest unread cell is known [cells]."""
_READ_M = 0.10
"""A place on a limb is read if a point lies within this distance [m]."""
_ON_BONE_M, _FEW = 0.06, 4
"""Distance from the surface within which points count [m], and number of points below which a place is unread."""
_HIDDEN_SHARE = 0.6
"""A bone is hidden if no camera shows at least this share of its samples."""
_LEGS = [PARTS.index(f"{side}_leg") for side in ("left", "right")]
_FOREARMS_AND_SHINS = [
    BODY_JOINTS.index(f"{side}{b}") for side in ("Left", "Right") for b in ("ForeArm", "Leg")
]
_BELOW_KNEES = [
    b for b, name in enumerate(BODY_JOINTS) if name.endswith(("Leg", "Foot")) and "UpLeg" not in name
]
_WHY = {COVERED: "covered", OUTSIDE: "outside"}
_TOLD_AFTER_NS = 500_000_000


def marked(
    fitter: Fitter,
    figure: BodyShape,
    pose: Pose,
    silhouettes: tuple[Silhouette, ...],
    points: MeasuredPoints,
) -> tuple[Silhouette, ...]:
    """Return the silhouettes with the unread places on the legs marked; cells without readings are undecided there.

    A place is marked if it lies beyond the last point on the leg and is unread in the expected or in a hanging pose.

    Args:
        pose: the expected pose.
        points: of the performer.
    """
    samples = figure.samples
    cone = samples[:, 0].astype(np.int64)
    limb = np.isin(figure.surface.part[cone], _LEGS)
    samples, cone = samples[limb], cone[limb]
    radii_m = _radii(figure, samples)
    hanging = pose.with_angles(np.where(_of_legs(fitter), fitter.limits.rest, pose.angles))
    expected, usual = (_places(fitter, figure, there, samples) for there in (pose, hanging))
    away = np.linalg.norm(points.places[:, None] - expected, axis=2).min(axis=0, initial=np.inf)
    limbs, thirds = figure.surface.part[cone], _sample_of(figure)
    out = []
    for seen in silhouettes:
        dark = shown(seen, expected) == UNREAD
        far = dark & _out_of_range(seen, expected, radii_m)
        blind = dark | (shown(seen, usual) == UNREAD)
        for part in np.unique(limbs):
            beyond = False  # goes from a limb's end to its root
            own = np.flatnonzero(limbs == part)
            for k in own[::-1]:
                blind[k] &= beyond or far[k] or away[k] > _READ_M
                beyond = blind[k]
            if blind[own].mean() > _UNREAD_SHARE:  # includes a foot expected next to its hole in the floor
                blind[own[int(blind[own].argmax()) :]] = True
        unread = np.zeros(len(limb), bool)
        unread[limb] = blind
        nearest = seen.nearest
        if blind.any():
            nearest = np.empty_like(nearest)
            nearest_cells(unread_cells(seen.depth, seen.nearest), _MARGIN, nearest)
        out.append(seen._replace(unread=unread[thirds], nearest_unread=nearest))
    return tuple(out)


class Shown(NamedTuple):
    """Visibility of a body to the cameras.

    Attributes:
        hidden: whether no camera shows a body of the chain, shape (body_count,).
        samples: whether no camera shows a sample of the figure, shape (sample_count,).
        why: by camera, why it shows neither leg below the knee; see `why_unread`.
    """

    hidden: NDArray[np.bool_]
    samples: NDArray[np.bool_]
    why: tuple[str, ...]


def shown_of(fitter: Fitter, figure: BodyShape, pose: Pose, silhouettes: tuple[Silhouette, ...]) -> Shown:
    """Return which parts of a body in a pose the cameras of these silhouettes show."""
    places = _places(fitter, figure, pose, figure.samples)
    codes = np.stack([_codes(figure, seen, places) for seen in silhouettes])
    why = tuple(why_unread(figure, places, seen, row) for seen, row in zip(silhouettes, codes, strict=True))
    samples = (codes != SEEN).all(axis=0)
    return Shown(_hidden_bones(figure, samples), samples, why)


def unread_ends(
    fitter: Fitter, figure: BodyShape, fit: Fit, points: MeasuredPoints, shown: Shown
) -> NDArray[np.bool_]:
    """Return whether each body of the chain is unread next to its joint, and at its far end, shape (body_count, 2).

    A place is read if a camera shows it, or some points lie on the surface around it. The far end of a forearm or
    shin is unread if other parts of the body explain its points as well: it may lie elsewhere on the body.
    """
    near = fit.distance.min(axis=1) < _ON_BONE_M
    *_, origins, frames = fitter.place(figure, fit.pose)
    cone = fit.cone[near]
    along = np.einsum("pi,pi->p", points.places[near] - origins[cone], frames[cone, :, 2])
    column = np.clip(3.0 * along / figure.surface.length[cone], 0, 2).astype(np.int64)
    count = np.bincount(_sample_of(figure)[cone, column], minlength=len(figure.samples))
    unread = shown.samples & (count < _FEW)
    body = figure.surface.body[figure.samples[:, 0].astype(np.int64)]
    out = np.zeros((len(BODY_JOINTS), 2), bool)
    out[body[::-1], 0] = unread[::-1]  # the last write wins
    out[body, 1] = unread
    out[_FOREARMS_AND_SHINS, 1] |= _beside_other_parts(figure, fit)[_FOREARMS_AND_SHINS] < SURE
    return out


def _beside_other_parts(figure: BodyShape, fit: Fit) -> Array:
    """Return the log-likelihood that each body of the chain adds to the other parts, shape (body_count,)."""
    each = np.arange(len(fit.cone)), figure.surface.part[fit.cone]
    others = fit.distance.copy()
    others[each] = REACH_M
    return log_likelihoods(figure, fit, added_by(fit.distance[each], others.min(axis=1)))


def _sample_of(figure: BodyShape) -> NDArray[np.int64]:
    """Return the sample for each third of a figure's cones, shape (cone_count, 3)."""
    cone, number = figure.samples[:, 0].astype(np.int64), np.arange(len(figure.samples))
    out = np.zeros((len(figure.surface.body), 3), np.int64)
    out[cone] = number[:, None]  # all thirds of a short cone
    out[cone, np.minimum(3.0 * figure.samples[:, 1], 2.0).astype(np.int64)] = number
    return out


def _codes(figure: BodyShape, seen: Silhouette, places: Array) -> NDArray[np.int64]:
    """Return what a camera shows at a figure's samples; a marked leg is unread wherever the pose puts it."""
    cone = figure.samples[:, 0].astype(np.int64)
    columns = [unread_column(share) for share in figure.samples[:, 1]]
    codes = shown(seen, places)
    return np.where(seen.unread[cone, columns] & (codes == SEEN), UNREAD, codes)


def _hidden_bones(figure: BodyShape, hidden: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return whether each body is hidden; `hidden`: by sample."""
    body = figure.surface.body[figure.samples[:, 0].astype(np.int64)]
    count = np.bincount(body, minlength=len(BODY_JOINTS))
    share = np.bincount(body, weights=hidden, minlength=len(BODY_JOINTS)) / np.maximum(count, 1)
    return (count > 0) & (share >= _HIDDEN_SHARE)


def _places(fitter: Fitter, figure: BodyShape, pose: Pose, samples: Array) -> Array:
    *_, origins, frames = fitter.place(figure, pose)
    return sample_places(figure, origins, frames, samples)


def _radii(figure: BodyShape, samples: Array) -> Array:
    """Return the figure's radius at samples [m], shape (sample_count,)."""
    cone, share = samples[:, 0].astype(np.int64), samples[:, 1]
    surface = figure.surface
    return surface.start_radius[cone] + share * (surface.end_radius[cone] - surface.start_radius[cone])


def _out_of_range(seen: Silhouette, places: Array, radii_m: Array) -> NDArray[np.bool_]:
    """Return whether the surface around places on axes is farther away than a camera's farthest reading."""
    away_m = places @ seen.rotation[2] + seen.translation[2] - radii_m
    return away_m > seen.depth.max()


def _of_legs(fitter: Fitter) -> NDArray[np.bool_]:
    """Return whether each angle belongs to a leg, shape (dof_count,)."""
    return np.array([part_of(name.split("_")[0]) in _LEGS for name in fitter.limits.names])


def why_unread(figure: BodyShape, places: Array, seen: Silhouette, codes: NDArray[np.int64]) -> str:
    """Return why a camera does not show the legs below the knees: `range`, `no_depth`, `covered` or `outside`.

    "" = it shows at least one of them.

    Args:
        places: of the figure's samples [m], shape (sample_count, 3).
        codes: what the camera shows there; see `shown`.
    """
    below = np.isin(figure.surface.body[figure.samples[:, 0].astype(np.int64)], _BELOW_KNEES)
    legs = codes[below]
    code = int(np.bincount(legs).argmax())
    if code == SEEN or (legs != SEEN).mean() < _HIDDEN_SHARE:
        return ""
    if code != UNREAD:
        return _WHY[code]
    far = _out_of_range(seen, places[below], _radii(figure, figure.samples[below]))
    return "range" if 2 * far.sum() > len(far) else "no_depth"


class LegsUnread:
    """Reasons why cameras have not shown the legs for some time."""

    def __init__(self) -> None:
        self._since_ns: dict[str, int] = {}
        self.why: dict[str, str] = {}

    def told(self, time_ns: int, why: dict[str, str]) -> None:
        """Add an instant: by camera, why it does not show the legs; see `why_unread`."""
        self._since_ns = {name: self._since_ns.get(name, time_ns) for name, reason in why.items() if reason}
        self.why = {
            name: why[name]
            for name, since_ns in self._since_ns.items()
            if time_ns - since_ns >= _TOLD_AFTER_NS
        }
