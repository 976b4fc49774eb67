"""A single camera without depth that sees the performer counts less: its errors would decide the body's distance."""

import numpy as np

from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.model.triangulation.rays import FREE_M
from studio.engine.whole_take.finish.measurements import ALONE_SHARE, Measurements, measure

FRAME_S = 1 / 60
FRAMES, GONE, GAP = 60, 30, (10, 12)
"""The second camera sees the performer up to this frame, with a gap that is too short for an absence."""


def measured(*along_m: float) -> Measurements:
    shape = (FRAMES, len(along_m), JOINT_COUNT)
    positions = np.broadcast_to([0.0, 0.0, 1.0], (*shape, 3)).copy()
    positions[GONE:, 1:] = positions[slice(*GAP), 1:] = np.nan
    centres = np.array([[3.0, 0.0, 1.0], [0.0, 3.0, 1.0]])[: len(along_m)]
    return measure(positions, np.ones(shape), np.zeros(shape[:2]), centres, np.array(along_m))


def test_a_camera_counts_less_while_no_other_sees_the_performer() -> None:
    before = measured(FREE_M, FREE_M)
    after = before.alone_for_less(FRAME_S)
    share = after.lateral[:, 0] / before.lateral[:, 0]
    assert (share[: GONE + 6] == 1.0).all()
    assert np.allclose(share[GONE + 6 :, INDEX["left_elbow"]], ALONE_SHARE)
    ends = share[GONE + 6 :, [INDEX["left_hand"], INDEX["left_ankle"], INDEX["left_knee"]]]
    assert np.allclose(ends, ALONE_SHARE * np.array([1 / 2, 1 / 1.5, 1]) ** 2)
    np.testing.assert_allclose(after.axial[:, 0], before.axial[:, 0] * share)


def test_cameras_with_depth_and_one_alone_in_its_take_count_as_ever() -> None:
    for before in (measured(np.nan, FREE_M), measured(FREE_M)):
        after = before.alone_for_less(FRAME_S)
        np.testing.assert_array_equal(after.lateral, before.lateral)
