"""One camera's depth images: floor, background and the clusters in front of the background."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import invert_transform
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.seeing.fitting.cones import CONE_COUNT
from studio.engine.seeing.fitting.fit import MeasuredPoints
from studio.engine.seeing.images.clusters import Clusters, clusters_of
from studio.engine.seeing.images.floor import find_floor, stand_on
from studio.engine.seeing.images.grid import confirmed, grid_points, lens_of, sampled
from studio.engine.seeing.images.silhouette import FAR_M, Silhouette, nearest_cells

Array = NDArray[np.float64]

FLOOR_M = 0.035
"""Largest height of floor points [m]."""
LEAST_CELLS = 20
MOST_CLUSTERS = 40
_UP = np.array([0.0, -1.0, 0.0])
_LEVEL_HEIGHT_M = 1.0
"""Assumed height of a level camera that sees no floor."""


@dataclass(frozen=True)
class ImageClusters:
    """The content of one image: its grid in the working frame, its confirmed cells and its clusters."""

    points: Array
    depth: Array
    keep: NDArray[np.bool_]
    clusters: Clusters


class CameraView:
    """A camera's grid and its background, learnt during tracking.

    Attributes:
        T_work_camera: camera points to the working frame; None until the first image if it is not given.
    """

    def __init__(self, camera: DepthCamera, T_work_camera: Array | None) -> None:
        self.camera = camera
        self.lens = lens_of(camera)
        self.T_work_camera = T_work_camera
        shape = (camera.height // self.lens.stride, camera.width // self.lens.stride)
        self.cell_angle = self.lens.stride / camera.fx
        self._background = np.zeros(shape)
        self._use = np.zeros(shape, dtype=bool)

    @property
    def eye(self) -> Array:
        """The camera in the working frame [m], shape (3,)."""
        assert self.T_work_camera is not None
        return self.T_work_camera[:3, 3]

    def see(self, depth_mm: NDArray[np.uint16]) -> ImageClusters:
        """Return the points and clusters of an image.

        Raises:
            FormatError: the size of the image is not the camera's.
        """
        if depth_mm.shape != (self.camera.height, self.camera.width):
            raise FormatError(
                "depth.image_size",
                "a depth image of {width} x {height} pixels came from a camera of {own_width} x "
                "{own_height}; give the intrinsics that belong to the images",
                width=depth_mm.shape[1],
                height=depth_mm.shape[0],
                own_width=self.camera.width,
                own_height=self.camera.height,
            )
        points = np.zeros((*self._background.shape, 3))
        depth = np.zeros(self._background.shape)
        keep = np.zeros(self._background.shape, dtype=bool)
        if self.T_work_camera is None:
            self.T_work_camera = self._stand(depth_mm, points, depth)
        T = self.T_work_camera
        grid_points(depth_mm, self.lens, T[:3, :3].copy(), T[:3, 3].copy(), points, depth)
        confirmed(depth, keep)
        _candidates(points, depth, keep, self._background, FLOOR_M, self._use)
        clusters = Clusters(
            *clusters_of(points, depth, self._use, self.cell_angle, LEAST_CELLS, MOST_CLUSTERS)
        )
        return ImageClusters(points, depth, keep, clusters)

    def _stand(self, depth_mm: NDArray[np.uint16], points: Array, depth: Array) -> Array:
        """Return `T_work_camera` on the floor of an image, or of a level camera if it shows none."""
        grid_points(depth_mm, self.lens, np.eye(3), np.zeros(3), points, depth)
        some = points[depth > 0][::7]
        plane = find_floor(np.ascontiguousarray(some), _UP)
        return stand_on(np.array([*_UP, -_LEVEL_HEIGHT_M]) if plane is None else plane)

    def learn_background(self, seen: ImageClusters, standing: NDArray[np.bool_]) -> None:
        """Add still points behind people to the background.

        Args:
            standing: whether each cluster may be a person and so not background, shape (cluster_count,).
        """
        _learn(seen.depth, seen.keep, seen.clusters.labels, standing, self._background)

    def points_of(
        self, seen: ImageClusters, chosen: NDArray[np.bool_], count: int, index: int
    ) -> MeasuredPoints:
        """Return about `count` points of the chosen clusters, evenly over the image."""
        assert self.T_work_camera is not None
        places, views, normals = sampled(
            seen.points,
            seen.depth,
            seen.clusters.labels,
            chosen,
            count,
            self.T_work_camera[:3, 3].copy(),
        )
        return MeasuredPoints(places, views, normals, np.full(len(places), index))

    def silhouette_of(self, seen: ImageClusters, chosen: NDArray[np.bool_]) -> Silhouette:
        """Return the silhouette of the chosen clusters."""
        assert self.T_work_camera is not None
        T = invert_transform(self.T_work_camera)
        person = np.append(chosen, False)[seen.clusters.labels]
        nearest = np.empty(person.shape, np.int32)
        distance_m = float(seen.depth[person].mean()) if person.any() else FAR_M
        nearest_cells(person, int(FAR_M / (self.cell_angle * distance_m)) + 1, nearest)
        return Silhouette(
            self.lens,
            T[:3, :3].copy(),
            T[:3, 3].copy(),
            seen.depth,
            nearest,
            np.zeros((CONE_COUNT, 3), bool),
            nearest,
        )


@compiled
def _candidates(points, depth, keep, background, floor, use):
    """Fill `use`: cells with a confirmed reading above the floor and before the background."""
    rows, columns = depth.shape
    for i in range(rows):
        for j in range(columns):
            z, behind = depth[i, j], background[i, j]
            use[i, j] = (
                keep[i, j]
                and points[i, j, 2] > floor
                and (behind <= 0.0 or z < behind - (0.05 + 0.004 * z * z))
            )


@compiled
def _learn(depth, keep, labels, standing, background):
    rows, columns = depth.shape
    for i in range(rows):
        for j in range(columns):
            label = labels[i, j]
            if label >= 0 and not standing[label] and keep[i, j]:
                behind = background[i, j]
                background[i, j] = depth[i, j] if behind <= 0.0 else behind + 0.1 * (depth[i, j] - behind)
