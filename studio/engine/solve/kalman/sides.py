"""Left and right at the start of a solve by rays: all combinations of cameras that may have exchanged them."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from studio.engine.model.frames import FrameSet, FusedSkeleton
from studio.engine.model.joints import JOINT_COUNT, MIRROR
from studio.engine.model.triangulation.rays import exchanges, placed
from studio.engine.solve.fusion.robust import RobustFusion


def ways_of_sides(frames: FrameSet) -> Iterator[FusedSkeleton]:
    """Yield the joints as the cameras name them, then with left and right exchanged in some of them.

    Of two combinations that differ only by an exchange in all cameras, one is yielded.
    """
    yield RobustFusion().fuse(frames)
    count = len(frames.cameras)
    positions, confidence = np.full((count, JOINT_COUNT, 3), np.nan), np.zeros((count, JOINT_COUNT))
    for reading in frames.readings:  # the newest of each camera comes last
        positions[reading.camera], confidence[reading.camera] = reading.positions, reading.confidence
    for turned in exchanges(np.flatnonzero(frames.rays)):
        other, sure = positions.copy(), confidence.copy()
        other[turned], sure[turned] = other[turned][:, MIRROR], sure[turned][:, MIRROR]
        found, known = placed(other, sure, frames.camera_positions, frames.rays)
        yield RobustFusion().fuse(replace(frames, positions=found, confidence=known))
