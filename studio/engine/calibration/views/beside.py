"""An ordinary camera next to depth cameras, placed by the skeleton that the depth cameras see.

The network's guesses of the body, under one common rotation, give direction and clock. The pixels then give the
place, by linear least squares. A robust adjustment of place, direction, focal length, distortion and clock follows.
Source: resection (Hartley, Zisserman, "Multiple View Geometry", 2004, chapter 7).
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import make_transform
from studio.engine.base.sentences import say
from studio.engine.calibration.views.judging.early import knees_seen
from studio.engine.calibration.views.judging.figures import motion_of, rests_of
from studio.engine.calibration.views.judging.result import NOWHERE, PlacedView, Uncertain
from studio.engine.calibration.views.judging.verdict import ViewFacts, verdict
from studio.engine.calibration.views.seen.bodies import Array
from studio.engine.calibration.views.seen.tracks import Sample, ViewTrack, make_track, nearest, sample
from studio.engine.calibration.views.seen.view import COLUMNS, NUMBER, View
from studio.engine.model.cameras.lens import Lens, usual_lens
from studio.engine.model.triangulation.guess import shift_equations

LONGEST_S = 2.0
"""Largest deviation of the clock offset from the expected one in the search."""

_STEP_S = 1.0 / 30.0
_LEAST_FRAMES = 60
_FOCALS = np.geomspace(0.6, 1.6, 9)
"""Focal lengths to try first, relative to a usual one."""

_ROUNDS = 4
_ALIKE_FRAMES = 8.0
"""Number of frames over which errors of a landmark are correlated."""

_FOCAL_SD, _BEND_SD = 0.3, 0.1
_APART_DEG = 90.0


@dataclass(frozen=True)
class _Found:
    """A camera: rotation vector and translation to its frame, logarithm of the focal length, distortion, clock."""

    turn: Array
    shift: Array
    log_focal: float
    bend: float
    ahead_s: float

    @classmethod
    def of(cls, numbers: Array) -> "_Found":
        return cls(numbers[:3], numbers[3:6], float(numbers[6]), float(numbers[7]), float(numbers[8]))

    def numbers(self) -> Array:
        return np.array([*self.turn, *self.shift, self.log_focal, self.bend, self.ahead_s])


def place_beside(
    view: View, times_s: Array, joints_m: Array, *, near_s: float = 0.0, longest_s: float = LONGEST_S
) -> PlacedView:
    """Return the camera placed by known joints; a bad one has the verdict `refused` and reasons.

    Args:
        view: of the camera.
        times_s: instants on the stage clock [s], shape (instant_count,).
        joints_m: canonical joints at the instants, stage frame [m], shape (instant_count, 21, 3); NaN = unknown.
        near_s: expected delay of the camera's stamps behind the stage clock [s].
        longest_s: largest deviation of the clock from that [s].
    """
    track, joints = make_track(view), joints_m[:, COLUMNS]
    turned = [
        (_turned(track, times_s - near_s - late, joints), near_s + late)
        for late in np.arange(-longest_s, longest_s + _STEP_S / 2, _STEP_S)
    ]
    (alike, turn), ahead_s = max(turned, key=lambda one: one[0][0])
    if turn is None:
        return _refused(view)
    start = _start(track, sample(track, times_s - ahead_s), joints, turn, ahead_s)
    found, covariance, seen = _adjusted(track, times_s, joints, start)
    rest, weight, depth_m = _rest(found, track, seen, joints)
    focal = track.focal * np.exp(found.log_focal)
    uncertain = _uncertain(found, covariance, track.known)
    rests = rests_of(rest, weight, depth_m, focal)
    facts = ViewFacts(
        rests=replace(rests, mean_mrad=rests.median_mrad),  # the mean includes hidden and swapped joints
        uncertain=uncertain,
        focal_sought=not track.known,
        knees=knees_seen(view, track),
        alike=alike,
        parallax_deg=_APART_DEG,  # depth cameras know the place without it
        motion=motion_of(joints, np.array([0.0, 0.0, 1.0])),
        cameras=3,
    )
    word, reasons = verdict(facts)
    return PlacedView(
        _to_stage(found),
        _lens(found, track, view),
        ahead_s=found.ahead_s,
        rests=rests,
        uncertain=uncertain,
        coverage=float((seen.weight > 0).any(axis=1).mean()),
        verdict=word,
        reasons=reasons,
    )


def _turned(track: ViewTrack, times_s: Array, joints: Array) -> tuple[float, Array | None]:
    """Return the similarity of guessed bodies and joints, 0..1, and their common rotation (to the camera)."""
    rows, near = nearest(track, times_s)
    hips = joints[:, [NUMBER["left_hip"], NUMBER["right_hip"]]].mean(axis=1, keepdims=True)
    both = track.seen[rows] & near[:, None] & np.isfinite(joints[..., 0]) & np.isfinite(hips[..., 0])
    if (both.sum(axis=1) >= 8).sum() < _LEAST_FRAMES:
        return 0.0, None
    x = np.where(both[..., None], joints - hips, 0.0)
    y = np.where(both[..., None], track.world_m[rows], 0.0)
    u, s, v = np.linalg.svd(np.einsum("fja,fjb->ab", y, x))
    sign = np.sign(np.linalg.det(u @ v))
    return float((s * [1, 1, sign]).sum() / np.sqrt((x**2).sum() * (y**2).sum())), u @ np.diag(
        [1, 1, sign]
    ) @ v


def _start(track: ViewTrack, seen: Sample, joints: Array, turn: Array, ahead_s: float) -> _Found:
    """Return the camera by linear least squares, with the best of some focal lengths."""
    used = (seen.weight > 0) & np.isfinite(joints[..., 0])
    local, weight = joints[used] @ turn.T, np.tile(np.sqrt(seen.weight[used]), 2)
    best, out = np.inf, None
    for log_focal in [0.0] if track.known else np.log(_FOCALS).tolist():
        rays = seen.points[used] / (track.focal * np.exp(log_focal))
        rows, sides = shift_equations(local, rays)
        shift, *_ = np.linalg.lstsq(rows * weight[:, None], sides * weight, rcond=None)
        placed = local + shift
        depth = np.maximum(placed[:, 2:], 0.1)
        missed = np.median(np.linalg.norm(placed[:, :2] / depth - rays, axis=1)) * np.exp(log_focal)
        if missed < best:
            best = missed
            out = _Found(
                Rotation.from_matrix(turn).as_rotvec(),
                np.asarray(shift, np.float64),
                float(log_focal),
                0.0,
                ahead_s,
            )
    assert out is not None
    return out


def _adjusted(track: ViewTrack, times_s: Array, joints: Array, start: _Found) -> tuple[_Found, Array, Sample]:
    """Return the camera by robust least squares over all free parameters, its covariance, and the landmarks used."""
    from scipy.optimize import least_squares  # slow to load: not at the start of the server

    found, known = start, np.isfinite(joints[..., 0])
    seen = sample(track, times_s - found.ahead_s)
    covariance = np.eye(9)
    free = np.array([True] * 6 + [not track.known] * 2 + [True])
    for _ in range(_ROUNDS):
        used = (seen.weight > 0) & known
        root = np.sqrt(seen.weight[used])[:, None]
        here = found

        fit = least_squares(
            partial(_off, here, free, track.focal, joints[used], seen.points[used], seen.speed[used], root),
            here.numbers()[free],
            loss="soft_l1",
            f_scale=2.0,
            x_scale="jac",
        )
        whole = here.numbers()
        whole[free] = fit.x
        found = _Found.of(whole)
        seen = sample(track, times_s - found.ahead_s)
        covariance = np.zeros((9, 9))
        covariance[np.ix_(free, free)] = _ALIKE_FRAMES * np.linalg.pinv(fit.jac.T @ fit.jac)
    return found, covariance, seen


def _off(
    here: _Found,
    free: NDArray[np.bool_],
    focal: float,
    joints: Array,
    points: Array,
    speed: Array,
    root: Array,
    numbers: Array,
) -> Array:
    """Return residuals in standard deviations for the free parameters of a camera; `points` move with the clock."""
    whole = here.numbers()
    whole[free] = numbers
    now = _Found.of(whole)
    moved = points - (now.ahead_s - here.ahead_s) * speed
    missed = root * (_seen_at(now, focal, joints) - moved)
    return np.concatenate([missed.ravel(), [now.log_focal / _FOCAL_SD, now.bend / _BEND_SD]])


def _seen_at(found: _Found, focal: float, points: Array) -> Array:
    """Return stage points as pixels from the picture's middle, shape (n, 2)."""
    local = points @ Rotation.from_rotvec(found.turn).as_matrix().T + found.shift
    rays = local[:, :2] / np.maximum(local[:, 2:], 0.1)
    return focal * np.exp(found.log_focal) * rays * (1.0 + found.bend * (rays**2).sum(axis=1, keepdims=True))


def _rest(found: _Found, track: ViewTrack, seen: Sample, joints: Array) -> tuple[Array, Array, Array]:
    """Return residuals in pixels, their weights, and the joints' distance in front of the camera [m]."""
    known = np.isfinite(joints[..., 0])
    points = np.where(known[..., None], joints, 1.0).reshape(-1, 3)
    at = _seen_at(found, track.focal, points)
    depth = points @ Rotation.from_rotvec(found.turn).as_matrix()[2] + found.shift[2]
    return at.reshape(seen.points.shape) - seen.points, seen.weight * known, depth.reshape(known.shape)


def _uncertain(found: _Found, covariance: Array, known: bool) -> Uncertain:
    rotation = Rotation.from_rotvec(found.turn).as_matrix()
    x, y, z = found.shift
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    by_unknown = np.hstack([-rotation.T @ cross, -rotation.T])
    place = by_unknown @ covariance[:6, :6] @ by_unknown.T
    return Uncertain(
        float(np.sqrt(np.trace(place))),
        float(np.degrees(np.sqrt(np.trace(covariance[:3, :3])))),
        0.0 if known else float(np.sqrt(covariance[6, 6])),
        float(np.sqrt(covariance[8, 8])),
    )


def _to_stage(found: _Found) -> Array:
    rotation = Rotation.from_rotvec(found.turn).as_matrix().T
    return make_transform(rotation, -rotation @ found.shift)


def _lens(found: _Found, track: ViewTrack, view: View) -> Lens:
    if view.lens is not None:
        return view.lens
    usual, focal = usual_lens(view.width, view.height), track.focal * float(np.exp(found.log_focal))
    return replace(usual, fx=focal, fy=focal, distortion=(found.bend, 0.0, 0.0, 0.0))


def _refused(view: View) -> PlacedView:
    reason = say(
        "views.nothing_beside",
        "it and the depth cameras saw the performer together for too short: walk where both see you",
    )
    return PlacedView(
        NOWHERE, view.lens or usual_lens(view.width, view.height), verdict="refused", reasons=(reason,)
    )
