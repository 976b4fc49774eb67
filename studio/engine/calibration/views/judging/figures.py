"""Figures of an adjustment: residuals of landmarks, certainty of the cameras, and motion of the performer."""

from dataclasses import dataclass

import numpy as np

from studio.engine.calibration.views.adjusting.adjust import FittedRig
from studio.engine.calibration.views.adjusting.rig import AHEAD, FOCAL, SHIFT, TURN, CameraRig
from studio.engine.calibration.views.judging.result import Rests, Uncertain
from studio.engine.calibration.views.seen.bodies import Array
from studio.engine.calibration.views.seen.view import NUMBER

_SAME_PLACE_M, _SAME_DEG = 0.05, 2.0


@dataclass(frozen=True)
class BodyMotion:
    """The performer's motion, in metres unless stated otherwise.

    Attributes:
        travel_m: mean distance of the hips from the middle of their path.
        limbs_m: mean distance of wrists and ankles from their middle places relative to the hips.
        upright: vertical extent of the thighs as a share of their length: 1 = standing, 0 = seated.
    """

    travel_m: float
    limbs_m: float
    upright: float


def rests_of(rest: Array, weight: Array, depth_m: Array, focal: float) -> Rests:
    """Return the figures of one camera.

    Args:
        rest: [pixel], shape (instant_count, 17, 2).
        weight: 0 where a landmark was not used; depth_m: of the joints [m]; both of shape (instant_count, 17).
        focal: [pixel].
    """
    used = weight > 0
    distance = np.linalg.norm(rest, axis=-1)[used]
    if len(distance) == 0:
        return Rests()
    angle_mrad = distance / focal * 1e3
    across_mm = angle_mrad * np.maximum(depth_m[used], 0.0)
    (median_mrad, p95_mrad), (median_px, p95_px) = _usual(angle_mrad), _usual(distance)
    median_mm, p95_mm = _usual(across_mm)
    return Rests(
        float(angle_mrad.mean()), median_mrad, p95_mrad,
        float(distance.mean()), median_px, p95_px,
        median_mm, p95_mm, len(distance),
    )  # fmt: skip


def _usual(values: Array) -> tuple[float, float]:
    """Return median and 95th percentile."""
    return float(np.median(values)), float(np.percentile(values, 95))


def uncertain_of(fit: FittedRig) -> list[Uncertain]:
    """Return the uncertainty of each camera, from the covariance of a finished fit."""
    assert fit.covariance is not None and fit.columns is not None
    rig, covariance, columns = fit.rig, fit.covariance, fit.columns
    count = len(columns)
    centres = rig.optical_centres
    by_unknown = np.zeros((count, 3, len(covariance)))
    for c in range(1, count):
        turn, shift = rig.turns[c], rig.shifts[c]
        cross = np.array([[0, -shift[2], shift[1]], [shift[2], 0, -shift[0]], [-shift[1], shift[0], 0]])
        by_unknown[c][:, columns[c, SHIFT]] = -turn.T
        by_unknown[c][:, columns[c, TURN]] = -turn.T @ cross
    flat, way = by_unknown.reshape(count * 3, -1), (centres - centres[0]).ravel()
    flat = flat - np.outer(way, way @ flat) / max(float(way @ way), 1e-12)
    places = np.diag(flat @ covariance @ flat.T).reshape(count, 3)

    def deviation(c: int, column: int) -> float:
        at = columns[c, column]
        return float(np.sqrt(max(covariance[at, at], 0.0))) if at >= 0 else 0.0

    out = []
    for c in range(count):
        turned = [covariance[at, at] for at in columns[c, TURN] if at >= 0]
        out.append(
            Uncertain(
                float(np.sqrt(max(places[c].sum(), 0.0))) if c else 0.0,
                float(np.degrees(np.sqrt(max(sum(turned), 0.0)))),
                deviation(c, FOCAL),
                deviation(c, AHEAD),
            )
        )
    return out


def motion_of(joints: Array, up: Array) -> BodyMotion:
    """Return a performer's motion.

    Args:
        joints: [m], shape (instant_count, 17, 3); NaN = unknown.
        up: unit vector in the same frame.
    """
    hips = (joints[:, NUMBER["left_hip"]] + joints[:, NUMBER["right_hip"]]) / 2
    limbs = [joints[:, NUMBER[f"{s}_{j}"]] - hips for s in ("left", "right") for j in ("wrist", "ankle")]
    falls = []
    for side in ("left", "right"):
        thigh = joints[:, NUMBER[f"{side}_hip"]] - joints[:, NUMBER[f"{side}_knee"]]
        fall = thigh @ up / np.maximum(np.linalg.norm(thigh, axis=1), 1e-6)
        fall = fall[np.isfinite(fall)]
        falls.append(float(np.median(fall)) if len(fall) else 0.0)
    return BodyMotion(_spread(hips), float(np.mean([_spread(limb) for limb in limbs])), max(falls))


def parallax_deg(rig_centres: Array, hips: Array) -> Array:
    """Return the angle at the performer between each two cameras [degrees], shape (camera_count, camera_count): the
    median over time."""
    ways = rig_centres[:, None] - hips[None]
    ways /= np.maximum(np.linalg.norm(ways, axis=2, keepdims=True), 1e-9)
    cosine = np.einsum("afk,bfk->abf", ways, ways)
    known = np.isfinite(cosine).all(axis=(0, 1))
    if not known.any():
        return np.zeros(cosine.shape[:2])
    return np.degrees(np.median(np.arccos(np.clip(cosine[..., known], -1.0, 1.0)), axis=2))


def _spread(points: Array) -> float:
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) == 0:
        return 0.0
    return float(np.linalg.norm(points - np.median(points, axis=0), axis=1).mean())


def twins(rig: CameraRig) -> list[int | None]:
    """Return, for each camera, an earlier one with the same place and direction, or None."""
    centres = rig.optical_centres
    out: list[int | None] = []
    for c in range(len(centres)):
        near = [
            b
            for b in range(c)
            if np.linalg.norm(centres[b] - centres[c]) < _SAME_PLACE_M
            and np.trace(rig.turns[b] @ rig.turns[c].T) > 1.0 + 2.0 * np.cos(np.radians(_SAME_DEG))
        ]
        out.append(near[0] if near else None)
    return out
