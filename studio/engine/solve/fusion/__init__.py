"""Fusion (step 5): one skeleton from all cameras, and per joint which cameras were used or rejected, and why.

`mean` is the thesis's. `robust` weighs each camera by its noise and rejects outliers.
Reasons: `unseen`, `unsure` (below the confidence threshold), `outlier` (far from the possible places),
`disagrees` (other cameras agree on another place).
"""

from typing import Protocol

from studio.engine.model.frames import FrameSet, FusedSkeleton
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.fusion.mean import MeanFusion
from studio.engine.solve.fusion.robust import RobustFusion


class Fusion(Protocol):
    """Turns frame sets, in time order, into skeletons."""

    def fuse(self, frames: FrameSet) -> FusedSkeleton: ...


def make_fusion(settings: SolveSettings) -> Fusion:
    """Return the fusion of these settings."""
    return MeanFusion(settings.confidence_threshold) if settings.fusion == "mean" else RobustFusion()
