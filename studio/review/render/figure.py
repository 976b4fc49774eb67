"""Draws the mannequin in one pose with numpy alone: triangles into a depth buffer, soft light."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from studio.engine.animation.mannequin import BODY, SEAM, SkinnedMesh
from studio.engine.animation.mannequin.performer import Mannequin
from studio.engine.base.geometry import unit
from studio.engine.model.joints import OUTPUT_INDEX
from studio.review.render.raster import nearest

SUPERSAMPLING = 2
_TONES = np.empty((2, 3))
_TONES[[BODY, SEAM]] = [0.80, 0.815, 0.83], [0.36, 0.40, 0.45]
_HEAD = OUTPUT_INDEX["Head"]
_EYES, _VISOR = 0.52, 0.11
"""Middle of the visor above the chin, and half its height, as shares of the head's height."""

_BACKGROUND = np.array([0.925, 0.933, 0.945])
_GRID = np.array([0.80, 0.82, 0.845])
_KEY_LIGHT = np.array([-0.42, -0.62, 0.66])
_SHADOW_CELL_M = 0.015


@dataclass(frozen=True)
class Projection:
    """An orthographic view of the stage.

    Attributes:
        yaw_deg: direction of the viewer: 0 = in front of the T-pose (at -y), 90 = at +x.
        elevation_deg: angle of the viewer above the horizon.
        width, height: size of the picture [px].
        pixels_per_m: scale.
        target_m: stage point at (width / 2, `horizon` * height).
    """

    width: int = 200
    height: int = 300
    pixels_per_m: float = 135.0
    yaw_deg: float = 25.0
    elevation_deg: float = 9.0
    target_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    horizon: float = 0.88

    def axes(self) -> NDArray[np.float64]:
        """Rows: right, down and away from the viewer, in the stage frame, shape (3, 3)."""
        yaw, up = np.radians(self.yaw_deg), np.radians(self.elevation_deg)
        right = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        ahead = np.array([-np.sin(yaw) * np.cos(up), np.cos(yaw) * np.cos(up), -np.sin(up)])
        return np.stack([right, np.cross(ahead, right), ahead])


def _shadow(points: NDArray[np.float64], floor: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of the light that the figure blocks at floor points (..., 2), 0..1, same leading shape."""
    ground = points[:, :2] - points[:, 2:] * (_KEY_LIGHT[:2] / _KEY_LIGHT[2])[None, :] * 0.35
    low = ground.min(axis=0) - 0.4
    size = np.ceil((ground.max(axis=0) + 0.4 - low) / _SHADOW_CELL_M).astype(int) + 1
    cells = np.zeros(size)
    index = ((ground - low) / _SHADOW_CELL_M).astype(int)
    near = np.clip(1.0 - points[:, 2] / 2.2, 0.25, 1.0)
    np.maximum.at(cells, (index[:, 0], index[:, 1]), near)
    cells = gaussian_filter(cells, 2.6)
    where = np.moveaxis((floor - low) / _SHADOW_CELL_M, -1, 0)
    return map_coordinates(cells, where, order=1, mode="constant")


def _floor(view: Projection, points: NDArray[np.float64], s: int) -> NDArray[np.float64]:
    """The floor with its half-metre grid and the shadow, shape (height * s, width * s, 3)."""
    axes = view.axes()
    columns, rows = np.meshgrid(np.arange(view.width * s) + 0.5, np.arange(view.height * s) + 0.5)
    right = (columns / s - view.width / 2) / view.pixels_per_m
    down = (rows / s - view.horizon * view.height) / view.pixels_per_m
    origin = right[..., None] * axes[0] + down[..., None] * axes[1] + np.array(view.target_m)
    floor = origin - axes[2] * (origin[..., 2:] / axes[2, 2])
    image = np.broadcast_to(_BACKGROUND, (*columns.shape, 3)).copy()
    pixel_m = 1.0 / view.pixels_per_m
    for axis, width in (
        (0, pixel_m * 0.55),
        (1, pixel_m * 0.55 / max(np.sin(np.radians(view.elevation_deg)), 0.05)),
    ):
        nearest = np.abs(floor[..., axis] / 0.5 - np.round(floor[..., axis] / 0.5)) * 0.5
        distance = np.linalg.norm(floor[..., :2] - np.array(view.target_m[:2]), axis=-1)
        strength = (nearest < width) * np.clip(1.0 - distance / 1.9, 0.0, 1.0)
        image += strength[..., None] * (_GRID - image)
    return image * (1.0 - 0.36 * _shadow(points, floor[..., :2]))[..., None]


def _lit(
    normals: NDArray[np.float64], colours: NDArray[np.float64], ahead: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Colours under a key light, a sky and a faint rim, shape (N, 3)."""
    key = _KEY_LIGHT / np.linalg.norm(_KEY_LIGHT)
    facing = np.clip(-(normals @ ahead), 0.0, 1.0)
    diffuse = np.clip(normals @ key, 0.0, 1.0)
    sky = 0.5 + 0.5 * normals[:, 2]
    half = key - ahead
    shine = np.clip(normals @ (half / np.linalg.norm(half)), 0.0, 1.0) ** 28
    light = 0.43 + 0.27 * sky + 0.42 * diffuse - 0.10 * (1.0 - facing) ** 3
    return colours * light[:, None] + 0.10 * shine[:, None]


def _colours(
    mesh: SkinnedMesh,
    triangle: NDArray[np.int64],
    shares: NDArray[np.float64],
    tint: tuple[int, int, int] | None,
) -> NDArray[np.float64]:
    """Colours of points on a body's triangles, shape (n, 3), with its tint; a visor marks the face."""
    head = mesh.vertices_m[mesh.joint_indices[:, 0] == _HEAD]
    low, high = head.min(axis=0), head.max(axis=0)
    corners = mesh.triangles[triangle]
    place = np.einsum("nk,nki->ni", shares, mesh.vertices_m[corners])
    across, ahead, up = ((place - low) / (high - low)).T  # the performer faces -y in the T-pose
    on_head = (mesh.joint_indices[corners, 0] == _HEAD).all(axis=1) & (ahead < 0.5)
    visor = on_head & ((np.abs(across - 0.5) / 0.42) ** 3 + (np.abs(up - _EYES) / _VISOR) ** 3 < 1.0)
    tones = _TONES.copy()
    if tint is not None:
        tones[BODY] = np.array(tint) / 255.0
    return np.where(visor[:, None], tones[SEAM], tones[mesh.tones[triangle]])


@dataclass(frozen=True)
class PosedFigure:
    """A mannequin in a pose.

    Attributes:
        mannequin: the body.
        positions_m: output joints in the stage frame, shape (52, 3).
        rotations_wxyz: their world rotations, shape (52, 4).
        tint: colour of the body, RGB 0..255; None = default.
    """

    mannequin: Mannequin
    positions_m: NDArray[np.float64]
    rotations_wxyz: NDArray[np.float64]
    tint: tuple[int, int, int] | None = None


def draw_figure(
    mannequin: Mannequin,
    positions_m: NDArray[np.float64],
    rotations_wxyz: NDArray[np.float64],
    view: Projection,
) -> NDArray[np.uint8]:
    """Return a picture of one mannequin; see `PosedFigure` and `draw_figures`."""
    return draw_figures([PosedFigure(mannequin, positions_m, rotations_wxyz)], view)


def draw_figures(figures: Sequence[PosedFigure], view: Projection) -> NDArray[np.uint8]:
    """Return a picture of mannequins on the floor, shape (height, width, 3)."""
    s = SUPERSAMPLING
    axes, pixels = view.axes(), view.width * s * view.height * s
    posed = [one.mannequin.posed(one.positions_m, one.rotations_wxyz) for one in figures]
    meshes = [one.mannequin.mesh for one in figures]
    middles = [points[mesh.triangles].mean(axis=1) for (points, _), mesh in zip(posed, meshes, strict=True)]
    image = _floor(view, np.concatenate([*(points for points, _ in posed), *middles]), s).reshape(-1, 3)
    depth = np.full(pixels, np.nan)
    light = np.zeros((pixels, 3))
    for one, (points, normals), mesh in zip(figures, posed, meshes, strict=True):
        seen = (points - np.array(view.target_m)) @ axes.T
        seen[:, 0] = (seen[:, 0] * view.pixels_per_m + view.width / 2) * s
        seen[:, 1] = (seen[:, 1] * view.pixels_per_m + view.horizon * view.height) * s
        covered, triangle, shares, depths = nearest(seen, mesh.triangles, view.width * s, view.height * s)
        front = ~(depth[covered] <= depths)
        covered, triangle, shares = covered[front], triangle[front], shares[front]
        depth[covered] = depths[front]
        across = unit(np.einsum("nk,nki->ni", shares, normals[mesh.triangles[triangle]]))
        light[covered] = _lit(across, _colours(mesh, triangle, shares, one.tint), axes[2])
    shade = _crevices(depth.reshape(view.height * s, -1), 5.0 * s * view.pixels_per_m / 135.0).reshape(-1)
    body = np.isfinite(depth)
    image[body] = light[body] * shade[body, None]
    small = image.reshape(view.height, s, view.width, s, 3).mean(axis=(1, 3))
    return np.round(np.clip(small, 0.0, 1.0) * 255).astype(np.uint8)


def _crevices(depth: NDArray[np.float64], blur_px: float) -> NDArray[np.float64]:
    """Darkening of pixels behind their neighbours, 0..1; `depth` [m] is NaN outside the figure."""
    covered = np.isfinite(depth)
    weight = gaussian_filter(covered.astype(np.float64), blur_px)
    mean = gaussian_filter(np.where(covered, depth, 0.0), blur_px) / np.maximum(weight, 1e-6)
    behind = np.where(covered, depth - mean, 0.0)
    return 1.0 - np.clip(behind / 0.16, 0.0, 0.42)
