"""Bone length limit: clamps bones to a tolerance around their calibrated lengths (Ménard 2014, 5.5)."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import PARENTS


class BoneLengthLimit:
    """Keeps each canonical bone within `tolerance` (a fraction) of its calibrated length.

    Args:
        offsets_m: T-pose offsets of the canonical joints [m], shape (21, 3), as `Performer.offsets_m`.
        tolerance: 0.02 allows 2 per cent.
    """

    def __init__(self, offsets_m: NDArray[np.float64], tolerance: float) -> None:
        length = np.linalg.norm(offsets_m, axis=1)
        self._low, self._high = (1.0 - tolerance) * length, (1.0 + tolerance) * length

    def apply(self, joints: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the joints, shape (21, 3) [m], with clamped bones; a bone with an unseen end is not changed."""
        out = joints.copy()
        for joint in range(1, len(PARENTS)):
            bone = joints[joint] - joints[PARENTS[joint]]
            length = float(np.sqrt(bone @ bone))
            if not length > 1e-9:  # unseen (NaN) or no direction
                continue
            wanted = min(max(length, self._low[joint]), self._high[joint])
            out[joint] = out[PARENTS[joint]] + bone * (wanted / length)
        return out
