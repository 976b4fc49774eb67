"""Scale, floor and origin of ordinary cameras from a board of known size that at least two of them see.

The calibrated cameras' rays place the corners, at the calibration's own scale. The similarity transform between them
and the board gives the true scale. A board that lies on the floor gives the floor's height and, the larger it is, the
floor's slope; the standing feet give the rest. Source: Umeyama, "Least-squares estimation of transformation
parameters between two point patterns", PAMI 1991.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import CalibrationError
from studio.engine.base.geometry import make_transform
from studio.engine.calibration.views.adjusting.rig import rig_of
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.seeing.board import SeenBoard

Array = NDArray[np.float64]

_LEAST_CORNERS, _LEAST_ANGLE_DEG = 4, 4.0
_LARGEST_MISS = 0.06
"""Largest residual of the corners after the similarity, as a share of the board's extent (root mean square)."""

_LARGEST_SPREAD = 0.05
"""Largest relative spread of the sizes from the board at several moments."""

_LEAST_SPREAD = 0.003
"""Least standard error of a size, as a share: corners are found only to some tenths of a pixel."""

_LYING_DEG, _LYING_M = 15.0, 0.25
"""Largest tilt and largest distance from the floor under the feet of a board on the floor."""

_POINT_M, _SLOPE_SD = 0.004, np.radians(0.7)
"""Usual errors of a placed corner, and of the slope of the floor under the feet."""


@dataclass(frozen=True)
class Sighting:
    """A board in one camera's picture at an instant; pixels are of pictures of the size of the camera's lens."""

    camera: str
    instant: int
    seen: SeenBoard


@dataclass(frozen=True)
class BoardFound:
    """Result of a calibration with a board.

    Attributes:
        cameras: names of those that saw the board, sorted.
        sightings: number by two or more cameras at once, counted per tag.
        size: factor by which the stage was enlarged, 1 = unchanged.
        spread: standard error of that factor, as a share.
        on_floor: whether the board lay on the floor, and so gave the stage's floor and origin.
        tilt_deg: angle by which the floor was turned.
        raised_m: height by which the floor was raised.
    """

    cameras: tuple[str, ...]
    sightings: int
    size: float
    spread: float
    on_floor: bool
    tilt_deg: float = 0.0
    raised_m: float = 0.0


@dataclass(frozen=True)
class _Placed:
    """A board on the stage: number, corners [stage units], size [stage units per metre], upward direction and
    middle."""

    number: int
    corners: Array
    size: float
    up: Array
    middle: Array


def with_board(calibration: Calibration, sightings: Sequence[Sighting]) -> tuple[Calibration, BoardFound]:
    """Return the calibration at the board's scale, on its floor if it lies there, and the board's result.

    The direction of the stage does not change. The performer is scaled; the floor under him may differ from this one.

    Args:
        calibration: of cameras without depth.
        sightings: of one board, or of tags.

    Raises:
        CalibrationError: no two cameras saw it at once from different sides, or its sizes contradict each other.
    """
    placed = _placed(calibration, sightings)
    cameras = sorted({one.camera for one in sightings})
    if not placed:
        raise CalibrationError(
            "board.not_together",
            "the board was seen by {names}, but never by two cameras at once from different sides: lay it where two "
            "see it",
            names=cameras,
        )
    sizes = np.array([one.size for one in placed])
    size = float(np.median(sizes))
    spread = 1.4826 * float(np.median(np.abs(sizes / size - 1.0)))
    if spread > _LARGEST_SPREAD:
        raise CalibrationError(
            "board.contradicts",
            "the board's size at several moments differs by {percent:.0f} %: is it flat and stiff? Else calibrate "
            "with a longer walk",
            percent=100.0 * spread,
        )
    kept = [one for one in placed if abs(one.size / size - 1.0) < max(4.0 * spread, 0.02)]
    sure = max(spread / float(np.sqrt(len(kept))), _LEAST_SPREAD)
    found = BoardFound(tuple(cameras), len(placed), 1.0 / size, sure, on_floor=False)
    scaled = _scaled(calibration, 1.0 / size)
    lying = [one for one in kept if _lies(one, size)]
    if 2 * len(lying) < len(kept):
        return scaled, found
    T, tilt_deg = _floor(
        [replace(one, corners=one.corners / size, middle=one.middle / size) for one in lying]
    )
    moved = {
        name: replace(camera, T_stage_camera=T @ camera.T_stage_camera)
        for name, camera in scaled.cameras.items()
    }
    raised_m = -float((T @ [0.0, 0.0, 0.0, 1.0])[2])
    return replace(scaled, cameras=moved), replace(found, on_floor=True, tilt_deg=tilt_deg, raised_m=raised_m)


def _scaled(calibration: Calibration, by: float) -> Calibration:
    def larger(camera: CameraCalibration) -> CameraCalibration:
        T = camera.T_stage_camera
        median, p95 = camera.residual_median_mm, camera.residual_p95_mm
        return replace(
            camera,
            T_stage_camera=make_transform(T[:3, :3], by * T[:3, 3]),
            residual_median_mm=None if median is None else by * median,
            residual_p95_mm=None if p95 is None else by * p95,
        )

    who = calibration.performer
    performer = None if who is None else Performer(by * who.height_m, by * who.offsets_m, who.soles_measured)
    cameras = {name: larger(camera) for name, camera in calibration.cameras.items()}
    return replace(calibration, cameras=cameras, performer=performer)


def _placed(calibration: Calibration, sightings: Sequence[Sighting]) -> list[_Placed]:
    """Return the boards that two or more cameras saw at once, placed by the cameras' rays."""
    groups: dict[tuple[int, int], dict[str, SeenBoard]] = {}
    for one in sightings:
        groups.setdefault((one.instant, one.seen.number), {})[one.camera] = one.seen
    found = [_place(calibration.cameras, mine) for mine in groups.values() if len(mine) > 1]
    return [one for one in found if one is not None]


def _place(cameras: Mapping[str, CameraCalibration], seen: Mapping[str, SeenBoard]) -> _Placed | None:
    ids = np.unique(np.concatenate([one.ids for one in seen.values()]))
    points, weight = np.zeros((len(seen), len(ids), 2)), np.zeros((len(seen), len(ids)))
    focals, on_board = [], np.zeros((len(ids), 2))
    for c, (name, one) in enumerate(seen.items()):
        lens = cameras[name].lens
        assert lens is not None
        focals.append(0.5 * (lens.fx + lens.fy))
        at = np.searchsorted(ids, one.ids)
        rays = lens.rays_of(one.pixels) * focals[-1]
        good = np.isfinite(rays).all(axis=1)
        points[c, at], weight[c, at] = np.where(good[:, None], rays, 0.0), good
        on_board[at] = one.points
    placed = rig_of([cameras[name] for name in seen], focals).meeting(points, weight)
    known = np.isfinite(placed).all(axis=1)
    if known.sum() < _LEAST_CORNERS:
        return None
    corners, on_board = placed[known], on_board[known]
    centres = np.array([cameras[name].T_stage_camera[:3, 3] for name in seen])
    if _widest_deg(centres, corners.mean(axis=0)) < _LEAST_ANGLE_DEG:
        return None
    size, rotation, shift = _similarity(np.column_stack([on_board, np.zeros(len(on_board))]), corners)
    off = corners - (size * on_board @ rotation[:, :2].T + shift)
    extent = size * float(np.sqrt((on_board**2).sum(axis=1).mean()))
    if np.sqrt((off**2).sum(axis=1).mean()) > _LARGEST_MISS * extent:
        return None
    return _Placed(next(iter(seen.values())).number, corners, size, -rotation[:, 2], shift)


def _widest_deg(centres: Array, point: Array) -> float:
    """Return the largest angle at which two cameras see a point."""
    ways = (centres - point) / np.linalg.norm(centres - point, axis=1, keepdims=True)
    return float(np.degrees(np.arccos(np.clip((ways @ ways.T).min(), -1.0, 1.0))))


def _similarity(source: Array, target: Array) -> tuple[float, Array, Array]:
    """Return scale, rotation and translation from source to target points, each of shape (n, 3)."""
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, s, v = np.linalg.svd(b.T @ a)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ v))])
    rotation = (u * sign) @ v
    size = float((s * sign).sum() / (a**2).sum())
    return size, rotation, target.mean(axis=0) - size * rotation @ source.mean(axis=0)


def _lies(placed: _Placed, size: float) -> bool:
    flat = placed.up[2] > np.cos(np.radians(_LYING_DEG))
    return bool(flat and abs(placed.middle[2]) / size < _LYING_M)


def _floor(lying: list[_Placed]) -> tuple[Array, float]:
    """Return the transform that puts the stage's floor under the boards and its origin at the first, and the tilt.

    The plane of the corners is known to `_POINT_M`, the old floor's slope to `_SLOPE_SD`.
    """
    first = min(one.number for one in lying)
    middle = np.median([one.middle for one in lying if one.number == first], axis=0)
    corners = np.concatenate([one.corners for one in lying]) - middle
    share = len(corners) / max(len({one.number for one in lying}), 1) / len(lying[0].corners)
    A = np.column_stack([corners[:, :2], np.ones(len(corners))])
    normal = A.T @ A / (_POINT_M**2 * share) + np.diag([_SLOPE_SD**-2, _SLOPE_SD**-2, 0.0])
    a, b, c = np.linalg.solve(normal, A.T @ corners[:, 2] / (_POINT_M**2 * share))
    z = np.array([-a, -b, 1.0]) / np.sqrt(a * a + b * b + 1.0)
    y = np.array([0.0, 1.0, 0.0]) - z[1] * z
    y /= np.linalg.norm(y)
    rotation = np.array([np.cross(y, z), y, z])
    origin = middle + np.array([0.0, 0.0, c])
    return make_transform(rotation, -rotation @ origin), float(
        np.degrees(np.arccos(np.clip(z[2], -1.0, 1.0)))
    )
