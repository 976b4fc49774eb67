"""A simulated depth camera: performer and room, measured with a sensor's noise."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled
from studio.engine.base.geometry import invert_transform
from studio.simulator.performer.figure import Figure
from studio.simulator.performer.prop import HeldProp
from studio.simulator.sensor import structured_light, time_of_flight
from studio.simulator.sensor.raster import Rasteriser
from studio.simulator.sensor.room import Room, backdrop
from studio.simulator.sensor.sensors import Sensor, StructuredLight
from studio.simulator.sensor.view import SensorView

Array = NDArray[np.float64]


class SimulatedDepthCamera:
    """One camera on the stage.

    Args:
        sensor: the sensor model.
        T_stage_camera: its pose, shape (4, 4).
        figures: people and props in view; a person's figure belongs to this camera alone.
        room: the surroundings.
        rng: of its noise.
        cameras: number of cameras of the same sensor on the stage, this one included.
    """

    def __init__(
        self,
        sensor: Sensor,
        T_stage_camera: Array,
        figures: tuple[Figure | HeldProp, ...],
        room: Room,
        rng: np.random.Generator,
        *,
        cameras: int = 1,
    ) -> None:
        self.sensor = sensor
        self.T_stage_camera = T_stage_camera
        self._figures = figures
        self._room = room
        self._rng = rng
        self._cameras = cameras
        self._backdrop = backdrop(room, sensor.camera, T_stage_camera)
        self._rasteriser = Rasteriser(sensor.camera)
        self._T_camera_stage = invert_transform(T_stage_camera)

    def image(self, time_s: float) -> NDArray[np.uint16]:
        """Return the depth image at a time [mm], shape (H, W); 0 = no reading. Times must not decrease."""
        view = self.view(time_s)
        if self.sensor.family is None:
            near, far = self.sensor.range_m
            seen = (view.depth_m >= near) & (view.depth_m <= far)
            return np.where(seen, np.round(1e3 * np.where(seen, view.depth_m, 0.0)), 0).astype(np.uint16)
        if isinstance(self.sensor.family, StructuredLight):
            return structured_light.measure(self.sensor, view, self._rng, self._cameras)
        return time_of_flight.measure(self.sensor, view, self._rng)

    def view(self, time_s: float) -> SensorView:
        """Return the exact image at a time."""
        empty = self._backdrop
        depth, cosine = empty.depth_m.copy(), empty.cosine.copy()
        albedo, corner = empty.albedo.copy(), empty.corner.copy()
        for figure in self._figures:
            if time_s < figure.enters_s:
                continue
            index = np.full(depth.shape, -1, np.int32)
            vertices = figure.at(time_s)
            triangles = figure.mesh.triangles
            self._rasteriser.draw(vertices, triangles, self._T_camera_stage, depth, index)
            _shade(vertices, triangles, figure.mesh.albedo, self.T_stage_camera[:3, 3].copy(), index, cosine, albedo,
                   corner)  # fmt: skip
        return SensorView(depth, cosine, albedo, corner)


@compiled
def _shade(
    vertices: NDArray[np.float32],
    triangles: NDArray[np.int32],
    reflects: NDArray[np.float32],
    eye: Array,
    index: NDArray[np.int32],
    cosine: NDArray[np.float32],
    albedo: NDArray[np.float32],
    corner: NDArray[np.float32],
) -> None:
    """Set incidence, albedo and nearness to the floor where the body is seen."""
    for row in range(index.shape[0]):
        for column in range(index.shape[1]):
            t = index[row, column]
            if t < 0:
                continue
            a, b, c = vertices[triangles[t, 0]], vertices[triangles[t, 1]], vertices[triangles[t, 2]]
            ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
            vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            wx, wy, wz = eye[0] - a[0], eye[1] - a[1], eye[2] - a[2]
            size = ((nx * nx + ny * ny + nz * nz) * (wx * wx + wy * wy + wz * wz)) ** 0.5
            cosine[row, column] = abs(nx * wx + ny * wy + nz * wz) / size if size > 0 else 1.0
            albedo[row, column] = reflects[triangles[t, 0]]
            corner[row, column] = np.exp(-abs(a[2]) / 0.22)
