"""The canonical joints of poses, whose joints are named as in the output skeleton or canonically."""

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import CANONICAL, JOINT_COUNT, OUTPUT_OF_CANONICAL
from studio.engine.model.poses import Poses


def canonical_columns(poses: Poses) -> NDArray[np.int64]:
    """Return the index of the poses' joint for each canonical one, shape (21,); -1 = none.

    The poses' joints have the output skeleton's names, or canonical ones in some imported takes.
    """
    index = {name: i for i, name in enumerate(poses.joint_names)}
    return np.array([index.get(OUTPUT_OF_CANONICAL[name], index.get(name, -1)) for name in CANONICAL])


def canonical_positions(poses: Poses) -> NDArray[np.float64]:
    """Return the poses' canonical joints [m], shape (frame_count, 21, 3); NaN = missing."""
    return of_canonical(poses.positions_m, canonical_columns(poses), np.nan)


def of_canonical(
    values: NDArray[np.float64], columns: NDArray[np.int64], lacking: float
) -> NDArray[np.float64]:
    """Return values per joint of the poses, shape (frame_count, joint_count, ...), as values per canonical joint."""
    out = np.full((len(values), JOINT_COUNT, *values.shape[2:]), lacking)
    out[:, columns >= 0] = values[:, columns[columns >= 0]]
    return out
