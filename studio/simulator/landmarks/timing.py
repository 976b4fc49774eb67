"""Picture timing of an ordinary camera: a rolling shutter, and a rate that falls when a phone gets warm."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.base.geometry import transform_points
from studio.engine.model.cameras.lens import Lens

_NEAREST_M = 0.2


@dataclass(frozen=True)
class PictureTiming:
    """Picture timing of a camera.

    Attributes:
        readout_s: time from the first row to the last, 0 = all at once; the timestamp is that of the middle row.
        slow_s: spans of true time with fewer pictures [s].
        slow_share: share of the pictures taken in these spans.
    """

    readout_s: float = 0.0
    slow_s: tuple[tuple[float, float], ...] = ()
    slow_share: float = 0.4

    def taken(self, times_s: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of the pictures at these times are taken, shape (F,)."""
        due = np.floor(np.arange(len(times_s)) * self.slow_share)
        slow = np.zeros(len(times_s), dtype=np.bool_)
        for begin, end in self.slow_s:
            slow |= (times_s >= begin) & (times_s < end)
        return ~slow | (np.diff(due, prepend=-1.0) > 0)

    def joints(
        self, motion: CanonicalMotion, time_s: float, T_camera_stage: NDArray[np.float64], lens: Lens
    ) -> NDArray[np.float64]:
        """Return the joints in the stage frame, each at the readout time of its row [m], shape (21, 3)."""
        joints = motion.at(time_s)
        if not self.readout_s:
            return joints
        local = transform_points(T_camera_stage, joints)
        before = local[:, 2] > _NEAREST_M
        row = lens.pixels_of(np.where(before[:, None], local, 1.0))[:, 1]
        late_s = self.readout_s * (np.clip((row + 0.5) / lens.height, 0.0, 1.0) - 0.5)
        at_s = np.clip(time_s + late_s, 0.0, motion.duration_s)
        for k in np.flatnonzero(before):
            joints[k] = motion.at(float(at_s[k]))[k]
        return joints
