"""Fusion (step 5): one skeleton of all cameras', and which camera was used or rejected per joint, and why.

`mean` is the thesis's; `robust` weighs each camera by its noise, and rejects what disagrees.
Reasons: `unseen`, `unsure` (below the confidence threshold), `outlier` (far from where the joint can be),
`disagrees` (other cameras agree on another place).
"""

from typing import Protocol

from studio.engine.frames import FrameSet, FusedSkeleton
from studio.engine.fusion.mean import MeanFusion
from studio.engine.fusion.robust import RobustFusion
from studio.engine.settings import SolveSettings


class Fusion(Protocol):
    """Turns frame sets, in time order, into skeletons."""

    def fuse(self, frames: FrameSet) -> FusedSkeleton: ...


def make_fusion(settings: SolveSettings) -> Fusion:
    """Return the fusion that the settings name."""
    return MeanFusion(settings.confidence_threshold) if settings.fusion == "mean" else RobustFusion()
