"""Mean fusion, as in the thesis: the mean over cameras of the joints above the confidence threshold."""

import numpy as np

from studio.engine.model.frames import FrameSet, FusedSkeleton

SIGMA_M = 0.03
"""Standard deviation of one camera's joint, for the weights of the solve [m]."""


class MeanFusion:
    """Mean of the cameras' joints whose confidence reaches the threshold (Ménard 2014, 5.2)."""

    def __init__(self, confidence_threshold: float) -> None:
        self._threshold = confidence_threshold

    def fuse(self, frames: FrameSet) -> FusedSkeleton:
        """Return the mean skeleton; a joint below the threshold in every camera is unseen."""
        seen = ~np.isnan(frames.positions[:, :, 0])
        used = seen & (frames.confidence >= self._threshold)
        count = used.sum(axis=0)
        total = np.where(used[:, :, None], np.nan_to_num(frames.positions), 0.0).sum(axis=0)
        positions = np.full(total.shape, np.nan)
        np.divide(total, count[:, None], out=positions, where=count[:, None] > 0)
        confidence = np.where(used, frames.confidence, 0.0).max(axis=0)
        sigma = np.where(count > 0, SIGMA_M / np.sqrt(np.maximum(count, 1)), np.nan)
        reasons = {
            (int(c), int(j)): "unsure" if seen[c, j] else "unseen"
            for c, j in zip(*np.nonzero(~used), strict=True)
        }
        return FusedSkeleton(positions, confidence, sigma, used, reasons)
