"""Steps of a pipeline made from known poses, for the tests of live output."""

import numpy as np

from studio.engine.model.frames import FrameSet, FusedSkeleton, StepResult
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.model.poses import Poses


def step(poses: Poses, frame: int) -> StepResult:
    """Return a frame of poses as the pipeline would."""
    unseen = np.full((1, JOINT_COUNT, 3), np.nan)
    none = np.zeros((1, JOINT_COUNT))
    frame_set = FrameSet(round(poses.time_s[frame] * 1e9), ("camera_0",), unseen, none, np.zeros((1, 3)))
    fused = FusedSkeleton(unseen[0], none[0], np.full(JOINT_COUNT, np.nan), none > 0)
    return StepResult(
        frame_set,
        fused,
        poses.positions_m[frame],
        poses.rotations_wxyz[frame],
        poses.confidence[frame],
        poses.uncertainty_mm[frame],
    )
