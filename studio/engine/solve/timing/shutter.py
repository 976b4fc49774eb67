"""Rolling shutters (step 3): a picture's rows are read one after the other; its stamp is that of the middle row.

A landmark is moved along its path in the picture, from the time when its row was read to the time of the stamp.
Source of the model: Forssén, Ringaby, "Rectifying rolling shutter video from hand-held devices", CVPR 2010.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import CameraFrame, PictureJoints

_LONGEST_S = 0.1
"""Longest time between two frames from which speeds are taken."""

_LARGEST_STEP = 0.06
"""A landmark that moves by more from frame to frame, as a share of the picture's longer side, was read wrongly."""


class RollingShutter:
    """One camera's landmarks as they were at the stamps; takes its frames in order.

    Args:
        readout_s: time from the first row to the last [s]; 0 = all rows at once.
    """

    def __init__(self, readout_s: float) -> None:
        self._readout_s = readout_s
        self._before: tuple[int, PictureJoints] | None = None

    def settled(self, frame: CameraFrame) -> PictureJoints | None:
        """Return a frame's picture with its landmarks moved to the moment of its stamp."""
        picture, before = frame.picture, self._before
        if picture is None or not self._readout_s:
            return picture
        self._before = frame.device_time_ns, picture
        if before is None or (before[1].width, before[1].height) != (picture.width, picture.height):
            return picture
        step_s = (frame.device_time_ns - before[0]) * 1e-9
        if not 0.0 < step_s <= _LONGEST_S:
            return picture
        pixels = self._moved(picture, picture.pixels, before[1].pixels, step_s)
        hands, face = picture.hands, picture.face
        if hands is not None and before[1].hands is not None:
            hands = self._moved(picture, hands, before[1].hands, step_s)
        if face is not None and before[1].face is not None:
            face = self._moved(picture, face, before[1].face, step_s)
        return replace(picture, pixels=pixels, hands=hands, face=face)

    def _moved(
        self,
        picture: PictureJoints,
        pixels: NDArray[np.float64],
        before: NDArray[np.float64],
        step_s: float,
    ) -> NDArray[np.float64]:
        """Pixels, shape (..., 2), moved by their speed since the last frame; those without a speed stay."""
        step = pixels - before
        most = _LARGEST_STEP * max(picture.width, picture.height)
        usual = np.hypot(step[..., 0], step[..., 1]) < most  # NaN compares as False
        late = np.clip((pixels[..., 1] + 0.5) / picture.height, 0.0, 1.0) - 0.5
        share = np.where(usual, late * self._readout_s / step_s, 0.0)
        return pixels - share[..., None] * np.where(usual[..., None], step, 0.0)
