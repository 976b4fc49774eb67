"""A prop that swings in front of simulated depth cameras, with nobody present, and its true path."""

import numpy as np
from scipy.spatial.transform import Rotation

from studio.engine.rigid_bodies.known import shape_of
from studio.engine.seeing.props.sight import PropCamera
from studio.simulator.performer.prop import prop_mesh
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.camera import SimulatedDepthCamera
from studio.simulator.sensor.room import Room
from studio.simulator.sensor.sensors import find_sensor

HZ = 30.0
AFTER_S = (0.0, 0.012)
"""Delays of the cameras' images [s]: the second camera's are later."""


class MovingProp:
    """A prop that moves in a circle at 1.2 m/s and turns by 150 degrees a second, times its pace."""

    def __init__(self, text: str, pace: float = 1.0) -> None:
        self.shape, self.enters_s, self._pace = shape_of(text), 0.0, pace
        self.mesh = prop_mesh(self.shape)

    def pose(self, time_s: float) -> tuple[np.ndarray, np.ndarray]:
        time_s *= self._pace
        angle = 3.0 * time_s
        turn = Rotation.from_euler("xyz", [0.6 + 1.5 * time_s, 0.9 * np.sin(2 * time_s), 2.0 * time_s])
        place = np.array([0.4 * np.cos(angle), 0.4 * np.sin(angle), 1.1 + 0.2 * np.sin(angle)])
        return place, turn.as_matrix()

    def at(self, time_s: float) -> np.ndarray:
        place, turn = self.pose(time_s)
        return (self.mesh.vertices_m @ turn.T + place).astype(np.float32)


def scene(prop: MovingProp, seconds: float, sensor: str = "azure-kinect"):
    """Return the instants [s], the cameras (name, lens, T_stage_camera), and their images by camera."""
    rig, lens = standard_rig(2), find_sensor(sensor)
    room = Room.around(np.array([camera.T_stage_camera[:3, 3] for camera in rig]))
    times = np.arange(0.0, seconds, 1.0 / HZ)
    images = []
    for k, camera in enumerate(rig):
        rng = np.random.default_rng([1, k])
        simulated = SimulatedDepthCamera(lens, camera.T_stage_camera, (prop,), room, rng)  # type: ignore[arg-type]
        images.append([simulated.image(float(time_s) + AFTER_S[k]) for time_s in times])
    return times, [(one.name, lens.camera, one.T_stage_camera) for one in rig], images


def looks(cameras, images):
    """Return the function that `follow_prop` calls."""
    mine = [PropCamera(lens, T, shown[::4]) for (_, lens, T), shown in zip(cameras, images, strict=True)]
    return lambda k: [one.see(images[i][k], AFTER_S[i], []) for i, one in enumerate(mine)]


def errors(prop, found) -> tuple[np.ndarray, np.ndarray]:
    """Return the error of a followed prop's place [mm], and of its longest axis [degrees]."""
    truth = [prop.pose(float(time_s)) for time_s in found.time_s]
    away = np.linalg.norm(found.places_m - np.array([place for place, _ in truth]), axis=1) * 1e3
    axis = int(prop.shape.edges_m.argmax())
    own = Rotation.from_quat(found.rotations_wxyz, scalar_first=True).as_matrix()[:, :, axis]
    cosine = np.abs([a @ turn[:, axis] for a, (_, turn) in zip(own, truth, strict=True)])
    return away, np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
