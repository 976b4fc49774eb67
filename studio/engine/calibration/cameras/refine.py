"""All cameras' transforms and clocks and the depth bias at once: robust Gauss-Newton over every camera pair.

The residual of a joint that two cameras see is the distance between its two places in the reference camera's frame,
weighted with both cameras' noise (`noise`), which is larger along rays and far away. The unknowns are rotation,
translation, clock offset and drift of each camera except the reference, and one depth bias of all cameras.
"""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import cross, make_transform, transform_points
from studio.engine.calibration.cameras.noise import covariances, rays, unbiased
from studio.engine.calibration.cameras.pairs import LocalClock, Track, sample, velocity
from studio.engine.calibration.cameras.swaps import exchange

BIAS_PRIOR_M = 0.02
_BIAS_PRIOR_SD_M = 0.02
_KNOWN_SD_M = 1e-7
BIAS_RANGE_M = (0.0, 0.06)
"""Range of the depth bias: a surface lies in front of a joint's centre, by at most half of a body's thickness."""
_OFFSET_PRIOR_SD_S = 0.1
_DRIFT_PRIOR_SD = 1e-4
_INDEPENDENT_SHARE = 0.2
"""Weight of an observation, because the noise of neighbouring frames is correlated."""
_KERNEL = 3.0
_UNKNOWNS = 8
_CONVERGED = 2e-5
"""Steps [m, rad, s] at which the fit has converged: 0.02 mm, 0.001 degrees, 0.02 ms."""


@dataclass(frozen=True)
class PlacedCamera:
    """A camera in the reference camera's frame: transform (reference <- camera) and clock."""

    T: NDArray[np.float64]
    clock: LocalClock


@dataclass(frozen=True)
class Refined:
    """Result of `refine`: the cameras in order, the depth bias [m], and the offsets' standard deviations [s]."""

    cameras: list[PlacedCamera]
    depth_bias_m: float
    offset_sd_s: NDArray[np.float64]


@dataclass(frozen=True)
class _CameraView:
    """One camera's joints at the instants, in the reference camera's frame, with their noise and velocity."""

    points: NDArray[np.float64]
    velocity: NDArray[np.float64]
    covariance: NDArray[np.float64]
    since_middle_s: NDArray[np.float64]


def refine(
    tracks: list[Track],
    start: list[PlacedCamera],
    instants_s: NDArray[np.float64],
    swapped: NDArray[np.bool_],
    *,
    depth_bias_m: float = BIAS_PRIOR_M,
    fit_clocks: NDArray[np.bool_],
    fit_bias: bool = True,
    offsets_m: NDArray[np.float64] | None = None,
    iterations: int = 8,
) -> Refined:
    """Return the cameras and the depth bias that best align all cameras' joints.

    Args:
        tracks: the cameras, the reference first.
        start: their first placements; the reference's is fixed.
        instants_s: times on the reference's clock [s], shape (instant_count,).
        swapped: where left and right are swapped, shape (camera_count, instant_count).
        depth_bias_m: first value of the bias.
        fit_clocks: whether a camera's clock is unknown, shape (camera_count,).
        fit_bias: whether the depth bias is unknown.
        offsets_m: added to the cameras' joints in the reference camera's frame [m], shape (camera_count,
            instant_count, 21, 3); left and right as corrected.

    Source: Nocedal and Wright, "Numerical optimization", chapter 10 (Gauss-Newton); weights of Geman and
    McClure as in `rigid.fit_robust`; scale per joint and camera pair from the median of the residuals.
    """
    cameras, bias = list(start), depth_bias_m
    hessian = np.zeros((0, 0))
    bias_prior = (BIAS_PRIOR_M, _BIAS_PRIOR_SD_M) if fit_bias else (depth_bias_m, _KNOWN_SD_M)
    added = np.zeros(len(tracks)) if offsets_m is None else offsets_m
    for _ in range(iterations):
        views = [
            _view(*rest, instants_s, swap, bias, offset)
            for *rest, swap, offset in zip(tracks, cameras, swapped, added, strict=True)
        ]
        hessian, gradient = _normal_equations(views, cameras)
        _add_priors(hessian, gradient, start, cameras, fit_clocks)
        _add_bias_prior(hessian, gradient, bias, bias_prior)
        step = _solve(hessian, gradient)
        if not BIAS_RANGE_M[0] <= bias + step[-1] <= BIAS_RANGE_M[1]:
            change = float(np.clip(bias + step[-1], *BIAS_RANGE_M)) - bias
            step = np.append(_solve(hessian[:-1, :-1], gradient[:-1] + hessian[:-1, -1] * change), change)
        cameras = [cameras[0]] + [
            _moved(camera, step[_UNKNOWNS * i : _UNKNOWNS * (i + 1)]) for i, camera in enumerate(cameras[1:])
        ]
        bias += float(step[-1])
        if np.abs(step).max() < _CONVERGED:
            break
    variance = np.diag(np.linalg.pinv(hessian, hermitian=True)) / _INDEPENDENT_SHARE
    offset_sd = np.sqrt(np.maximum(np.append(0.0, variance[6:-1:_UNKNOWNS]), 0.0))
    return Refined(cameras, bias, offset_sd)


def _view(
    track: Track,
    camera: PlacedCamera,
    instants_s: NDArray[np.float64],
    swapped: NDArray[np.bool_],
    bias: float,
    offset: NDArray[np.float64] | float,
) -> _CameraView:
    device_s = camera.clock.device_s(instants_s)
    positions, confidence = sample(track, device_s)
    positions, confidence = exchange(positions, swapped), exchange(confidence, swapped)
    moving = exchange(velocity(track, device_s), swapped)
    R = camera.T[:3, :3]
    return _CameraView(
        points=transform_points(camera.T, unbiased(positions, bias)) + offset,
        velocity=moving @ R.T,
        covariance=covariances(positions, confidence, R),
        since_middle_s=device_s - camera.clock.middle_s,
    )


def _normal_equations(
    views: list[_CameraView], cameras: list[PlacedCamera]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return J^T W J and J^T W r over all camera pairs; the reference has no unknowns."""
    size = _UNKNOWNS * (len(views) - 1) + 1
    hessian, gradient = np.zeros((size, size)), np.zeros(size)
    for i, j in combinations(range(len(views)), 2):
        a, b = views[i], views[j]
        residual = a.points - b.points
        seen = np.isfinite(residual).all(axis=2)
        if seen.sum() < 10:
            continue
        residual, covariance_b = residual[seen], b.covariance[seen]
        information = _inverses(a.covariance[seen] + covariance_b)
        pull = (information @ residual[..., None])[..., 0]
        gain = (covariance_b @ pull[..., None])[..., 0]
        point = b.points[seen] + gain  # best estimate: its error is uncorrelated with the residual
        instant, joint = np.nonzero(seen)
        distance2 = (residual * pull).sum(axis=1)
        scale2 = _scales(distance2, joint)
        weight = (1.0 + distance2 / (_KERNEL**2 * scale2)) ** -2 / scale2
        information = information * weight[:, None, None]
        columns, jacobian = [], []
        for sign, index, view in ((1.0, i, a), (-1.0, j, b)):
            if index > 0:
                columns += range(_UNKNOWNS * (index - 1), _UNKNOWNS * index)
                moving, since = view.velocity[seen], view.since_middle_s[instant]
                jacobian.append(sign * _jacobian(point - cameras[index].T[:3, 3], moving, since))
        columns.append(size - 1)
        towards = rays(point - cameras[i].T[:3, 3]) - rays(point - cameras[j].T[:3, 3])
        jacobian.append(towards[:, :, None])
        J = np.concatenate(jacobian, axis=2)
        WJ = information @ J
        n = J.shape[2]
        hessian[np.ix_(columns, columns)] += J.reshape(-1, n).T @ WJ.reshape(-1, n)
        gradient[columns] += WJ.reshape(-1, n).T @ residual.reshape(-1)
    return hessian, gradient


def _inverses(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the inverses of symmetric matrices, shape (count, 3, 3), by their cofactors."""
    a, b, c = matrices.transpose(1, 0, 2)
    cofactors = np.stack([cross(b, c), cross(c, a), cross(a, b)], axis=1)
    return cofactors / (a * cofactors[:, 0]).sum(axis=1)[:, None, None]


def _scales(distance2: NDArray[np.float64], joint: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the variance scale of each observation: its joint's median divided by that of a chi-square of 3."""
    out = np.ones(len(distance2))
    for j in np.unique(joint):
        mine = joint == j
        out[mine] = np.clip(np.median(distance2[mine]) / 2.366, 0.5, 100.0)
    return out


def _jacobian(
    p: NDArray[np.float64], v: NDArray[np.float64], since_middle_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return derivatives of a camera's joints by its 8 unknowns, shape (count, 3, 8).

    Args:
        p: joints from the camera's centre, in the reference camera's axes [m], shape (count, 3).
        v: their velocities [m/s], same shape.
        since_middle_s: device time since the clock's middle [s], shape (count,).
    """
    out = np.zeros((len(p), 3, _UNKNOWNS))
    out[:, 0, 1], out[:, 0, 2] = p[:, 2], -p[:, 1]
    out[:, 1, 0], out[:, 1, 2] = -p[:, 2], p[:, 0]
    out[:, 2, 0], out[:, 2, 1] = p[:, 1], -p[:, 0]
    out[:, :, 3:6] = np.eye(3)
    out[:, :, 6] = -v
    out[:, :, 7] = -v * since_middle_s[:, None]
    return out


def _add_priors(
    hessian: NDArray[np.float64],
    gradient: NDArray[np.float64],
    start: list[PlacedCamera],
    cameras: list[PlacedCamera],
    fit_clocks: NDArray[np.bool_],
) -> None:
    """Add the clocks' priors: offset near the first guess, drift of a quartz."""
    for i in range(1, len(cameras)):
        a = _UNKNOWNS * (i - 1) + 6
        sd_offset, sd_drift = (_OFFSET_PRIOR_SD_S, _DRIFT_PRIOR_SD) if fit_clocks[i] else (1e-7, 1e-9)
        now, first = cameras[i].clock, start[i].clock
        for k, sd, change in (
            (a, sd_offset, now.offset_s - first.offset_s),
            (a + 1, sd_drift, now.drift),
        ):
            hessian[k, k] += 1.0 / sd**2 / _INDEPENDENT_SHARE
            gradient[k] += change / sd**2 / _INDEPENDENT_SHARE


def _add_bias_prior(
    hessian: NDArray[np.float64], gradient: NDArray[np.float64], bias: float, prior: tuple[float, float]
) -> None:
    """Add the prior of the depth bias: mean and standard deviation [m]."""
    mean, sd = prior
    hessian[-1, -1] += 1.0 / sd**2 / _INDEPENDENT_SHARE
    gradient[-1] += (bias - mean) / sd**2 / _INDEPENDENT_SHARE


def _solve(hessian: NDArray[np.float64], gradient: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the Gauss-Newton step, with scaled unknowns; unobserved unknowns do not change."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-12))
    scaled = hessian * scale[:, None] * scale[None, :] + 1e-9 * np.eye(len(hessian))
    return -scale * np.linalg.solve(scaled, scale * gradient)


def _moved(camera: PlacedCamera, step: NDArray[np.float64]) -> PlacedCamera:
    """Return the camera after a step of its unknowns."""
    rotation = Rotation.from_rotvec(step[:3]).as_matrix() @ camera.T[:3, :3]
    clock = replace(
        camera.clock,
        offset_s=camera.clock.offset_s + float(step[6]),
        drift=camera.clock.drift + float(step[7]),
    )
    return PlacedCamera(make_transform(rotation, camera.T[:3, 3] + step[3:6]), clock)
