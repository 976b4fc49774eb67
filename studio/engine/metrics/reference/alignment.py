"""Alignment of a solve to a reference: one rigid transform or similarity, and the clock if each has its own."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import fit_rigid, invert_transform, make_transform, transform_points
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.matching import Matched, match
from studio.engine.metrics.reference.reference import Reference
from studio.engine.metrics.results import AlignmentJson
from studio.engine.model.poses import Poses

_GRID_HZ = 100.0
_ROUNDS = 40
_LEAST_ROUNDS = 12
_WIDEST_M = 1.0
_ALIKE_S = 0.3
"""Correlation time of a solve's errors; each span of this length counts as one measurement."""

DRIFT_SIGMA_PPM = 300.0
"""Expected clock drift: quartz drifts by about 50 ppm, a clock that loses frames by far more."""


@dataclass(frozen=True)
class Alignment:
    """The result of an alignment: a point p of the stage lies at `scale` R p + t in the reference.

    Attributes:
        T_reference_stage: 4x4, rotation and translation [m], det(R) = +1; without the scale.
        scale: 1 unless a similarity was requested.
        offset_s: offset of the reference's clock from the stage clock at stage time 0, positive = ahead.
        drift_ppm: its drift, positive = faster.
    """

    T_reference_stage: NDArray[np.float64]
    scale: float = 1.0
    offset_s: float = 0.0
    drift_ppm: float = 0.0

    def to_reference(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return stage points, shape (..., 3), in the reference's frame."""
        return transform_points(self.T_reference_stage, self.scale * points_m)

    def to_stage(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return reference points, shape (..., 3), in the stage frame."""
        return transform_points(invert_transform(self.T_reference_stage), points_m) / self.scale

    def to_json(self) -> AlignmentJson:
        rotation = Rotation.from_matrix(self.T_reference_stage[:3, :3])
        return {
            "rotation_wxyz": rotation.as_quat(scalar_first=True, canonical=True).tolist(),
            "rotation_deg": float(np.degrees(rotation.magnitude())),
            "translation_m": self.T_reference_stage[:3, 3].tolist(),
            "scale": self.scale,
            "time_offset_ms": self.offset_s * 1e3,
            "clock_drift_ppm": self.drift_ppm,
        }

    @classmethod
    def from_json(cls, value: AlignmentJson) -> "Alignment":
        """Return the alignment that `to_json` wrote."""
        rotation = Rotation.from_quat(value["rotation_wxyz"], scalar_first=True).as_matrix()
        transform = make_transform(rotation, np.array(value["translation_m"]))
        return cls(transform, value["scale"], value["time_offset_ms"] * 1e-3, value["clock_drift_ppm"])


def align(matched: Matched, *, similarity: bool = False) -> tuple[Matched, Alignment]:
    """Return the match with the solve moved onto the reference, and the alignment.

    One transform is fitted for the whole take, over all measured joints and frames, so that a pose that drifts over
    time stays in the figures.

    Args:
        similarity: fit the size too (Umeyama, "Least-squares estimation of transformation parameters
            between two point patterns", PAMI 1991).
    """
    alignment = align_together([matched], similarity=similarity)
    return replace(matched, solve_m=alignment.to_reference(matched.solve_m)), alignment


def align_together(matches: Sequence[Matched], *, similarity: bool = False) -> Alignment:
    """Return the one alignment of several performers' matches; `similarity` as in `align`."""
    pairs = []
    for matched in matches:
        solve, reference = matched.pick(matched.joints)
        valid = np.isfinite(solve).all(axis=2) & np.isfinite(reference).all(axis=2)
        pairs.append((solve[valid], reference[valid]))
    solve, reference = (np.concatenate(points) for points in zip(*pairs, strict=True))
    scale = 1.0
    if similarity:
        a, b = solve - solve.mean(axis=0), reference - reference.mean(axis=0)
        R = fit_rigid(a, b)[:3, :3]
        scale = float(((a @ R.T) * b).sum() / (a * a).sum())
    return Alignment(fit_rigid(scale * solve, reference), scale)


def clock_of(poses: Poses, reference: Reference, *, start_s: float | None = None) -> tuple[float, float]:
    """Return the offset of the reference's clock at stage time 0 [s], positive = ahead, and its drift [ppm].

    The correlation of the joints' speeds, which no rigid transform changes, gives a first offset. Then clock and
    rigid transform are refined together on the positions (Gauss-Newton, Cauchy weights for outliers, whose
    width falls step by step to that of the errors). The prior of the drift is `DRIFT_SIGMA_PPM`, so a
    short motion or large errors leave it near 0.

    Raises:
        FormatError: less than 2 s of motion, or no motion in common.
    """
    offset, drift = _speed_offset(poses, reference, start_s), 0.0
    for k in range(_ROUNDS):
        matched, _ = align(match(poses, reference, start_s=start_s, offset_s=offset, drift_ppm=drift))
        step, middle_s = _clock_step(matched, reference, offset, drift, _WIDEST_M * 0.5**k)
        drift += step[1] * 1e6
        offset += step[0] - step[1] * middle_s
        if k > _LEAST_ROUNDS and abs(step[0]) < 1e-7:
            break
    return offset, drift


def _clock_step(
    matched: Matched, reference: Reference, offset_s: float, drift_ppm: float, widest_m: float
) -> tuple[NDArray[np.float64], float]:
    """Return the Gauss-Newton step of the offset in the middle of the take [s] and of the drift, and that middle [s].

    The rigid transform's six unknowns are solved for too, so that motion along a line is not confused with time.
    """
    solve, target = matched.pick(matched.joints)
    time = matched.time_s + offset_s + drift_ppm * 1e-6 * matched.time_s
    velocity = _velocity(reference, time, matched)
    valid = np.isfinite(solve + target + velocity).all(axis=2)
    residual, slope, place = (solve - target)[valid], velocity[valid], solve[valid]
    width = max(1e-6, 1.5 * float(np.median(np.linalg.norm(residual, axis=1))))
    weight = 1.0 / (1.0 + (residual**2).sum(axis=1) / max(width, widest_m) ** 2)
    middle_s = float(matched.time_s.mean())
    since = np.broadcast_to((matched.time_s - middle_s)[:, None], valid.shape)[valid]
    jacobian = np.zeros((len(residual), 3, 8))
    jacobian[..., 0], jacobian[..., 1] = slope, slope * since[:, None]
    jacobian[:, :, 2:5] = np.eye(3)
    for axis in range(3):  # rotations about each axis
        jacobian[:, :, 5 + axis] = np.cross(np.eye(3)[axis], place - place.mean(axis=0))
    root = np.sqrt(weight)[:, None]
    rows = (jacobian * root[..., None]).reshape(-1, 8)
    normal, right = rows.T @ rows, rows.T @ (residual * root).ravel()
    prior = _ALIKE_S * matched.rate_hz * (width / 1.5 / DRIFT_SIGMA_PPM * 1e6) ** 2 / 3.0
    normal[1, 1] += prior
    right[1] -= prior * drift_ppm * 1e-6
    return np.linalg.lstsq(normal, right, rcond=None)[0][:2], middle_s


def _velocity(reference: Reference, time_s: NDArray[np.float64], matched: Matched) -> NDArray[np.float64]:
    """Velocity of the matched joints of the reference [m/s], by central differences of 10 ms."""
    step = 0.005
    difference = reference.at(time_s + step) - reference.at(time_s - step)
    return replace(matched, reference_m=difference / (2 * step)).pick(matched.joints)[1]


def _speed_offset(poses: Poses, reference: Reference, start_s: float | None) -> float:
    """Offset [s] at which the summed speeds of the common joints agree best."""
    from scipy.signal import correlate, correlation_lags  # slow to load: not at the start of the server

    first = poses.time_s[0] if start_s is None else max(start_s, float(poses.time_s[0]))
    positions = np.where(reference.known[None, :, None], canonical_positions(poses), np.nan)
    solve_grid = np.arange(first, poses.time_s[-1], 1 / _GRID_HZ)
    reference_grid = np.arange(reference.time_s[0], reference.time_s[-1], 1 / _GRID_HZ)
    if min(len(solve_grid), len(reference_grid)) < 2 * _GRID_HZ:
        raise FormatError(
            "reference.too_short_to_align",
            "aligning clocks needs at least 2 s of motion in both the solve and the reference",
        )
    a = _speed(Reference(poses.time_s, positions).at(solve_grid))
    b = _speed(reference.at(reference_grid))
    score = correlate(b, a, mode="full")
    lags = correlation_lags(len(b), len(a), mode="full")
    overlap = np.minimum(len(b), lags + len(a)) - np.maximum(0, lags)
    score = np.where(overlap >= 0.3 * min(len(a), len(b)), score, -np.inf)
    if not np.isfinite(score).any() or score.max() <= 0:
        raise FormatError(
            "reference.no_motion_in_common",
            "the solve and the reference have no motion in common; is it the reference of this take?",
        )
    return float(reference_grid[0] + lags[int(np.argmax(score))] / _GRID_HZ - solve_grid[0])


def _speed(positions_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean speed over joints, without its mean over time, shape (sample_count - 1,)."""
    step = np.linalg.norm(np.diff(positions_m, axis=0), axis=2)
    counts = np.isfinite(step).sum(axis=1)
    speed = np.nansum(step, axis=1) / np.maximum(counts, 1)
    return speed - speed.mean()
