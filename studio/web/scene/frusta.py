"""Calibrated cameras in the browser view: poses, frusta and pictures."""

from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.base.geometry import quaternions
from studio.engine.model.calibration import CameraCalibration

_USUAL_FOV_RAD, _USUAL_ASPECT = np.radians(48.0), 4 / 3
_SIZE, _SIZE_WITH_PICTURE = 0.11, 0.17
_LABEL_ABOVE_M = 0.21


@dataclass(frozen=True)
class Picture:
    """A camera's picture: grey, shape (height, width); its vertical angle of view; a number that changes with it."""

    grey: NDArray[np.uint8]
    fov_rad: float
    number: int


class Frustum:
    """A calibrated camera: its frustum and name, in its colour."""

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        label: str,
        rgb: tuple[int, int, int],
        camera: CameraCalibration,
    ) -> None:
        T = camera.T_stage_camera
        self._shown: int | None = None
        self._frustum = server.scene.add_camera_frustum(
            f"{name}/frustum", float(_USUAL_FOV_RAD), _USUAL_ASPECT, scale=_SIZE, color=rgb, thickness=2.0,
            thickness_units="screen", wxyz=quaternions(T[:3, :3]), position=T[:3, 3], variant="filled",
            cast_shadow=False,
        )  # fmt: skip
        self._label = server.scene.add_label(
            f"{name}/name", label, position=T[:3, 3] + np.array([0.0, 0.0, _LABEL_ABOVE_M]),
            anchor="bottom-center", font_screen_scale=0.85,
        )  # fmt: skip

    def show(self, picture: Picture | None) -> None:
        """Show the camera's picture on its far plane, or nothing."""
        number = None if picture is None else picture.number
        if number == self._shown:
            return
        first, self._shown = self._shown is None, number
        if picture is None:
            self._frustum.image = None
            self._frustum.scale = _SIZE
            return
        if first:
            self._frustum.fov = picture.fov_rad
            self._frustum.aspect = picture.grey.shape[1] / picture.grey.shape[0]
            self._frustum.scale = _SIZE_WITH_PICTURE
        self._frustum.image = np.repeat(picture.grey[:, :, None], 3, axis=2)

    def remove(self) -> None:
        """Remove it from the scene."""
        self._frustum.remove()
        self._label.remove()
