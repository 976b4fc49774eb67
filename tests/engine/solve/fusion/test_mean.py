"""Mean fusion: the mean of the sufficiently confident joints."""

import numpy as np
import pytest

from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.model.settings.settings import parse_settings
from studio.engine.solve.fusion import make_fusion
from studio.engine.solve.fusion.mean import MeanFusion
from tests.engine.walkers import frame_set, standing

HEAD = INDEX["head"]


def test_it_is_the_mean_of_the_cameras():
    joints = standing()
    found = MeanFusion(0.75).fuse(frame_set(1.0, np.stack([joints, joints + 0.1, joints + 0.2])))
    assert found.positions == pytest.approx(joints + 0.1)
    assert found.used.all() and found.reasons == {}
    one = MeanFusion(0.75).fuse(frame_set(1.0, joints[None]))
    assert (found.sigma < one.sigma).all(), "more cameras, more certain"


@pytest.mark.parametrize(("confidence", "used"), [(0.76, True), (0.75, True), (0.74, False)])
def test_the_threshold_leaves_out_what_is_less_sure(confidence, used):
    joints = standing()
    sure = np.full((2, JOINT_COUNT), 0.9)
    sure[1, HEAD] = confidence
    found = MeanFusion(0.75).fuse(frame_set(1.0, np.stack([joints, joints + 0.1]), confidence=sure))
    assert found.used[1, HEAD] == used
    assert found.positions[HEAD] == pytest.approx(joints[HEAD] + (0.05 if used else 0.0))
    assert found.reasons == ({} if used else {(1, HEAD): "unsure"})
    assert found.confidence[HEAD] == pytest.approx(0.9)


def test_a_joint_that_nobody_is_sure_of_is_unseen():
    positions = np.stack([standing()] * 2)
    positions[0, HEAD] = np.nan
    sure = np.full((2, JOINT_COUNT), 0.9)
    sure[1, HEAD] = 0.1
    found = MeanFusion(0.75).fuse(frame_set(1.0, positions, confidence=sure))
    assert np.isnan(found.positions[HEAD]).all() and np.isnan(found.sigma[HEAD])
    assert found.confidence[HEAD] == 0
    assert found.reasons == {(0, HEAD): "unseen", (1, HEAD): "unsure"}
    assert np.isfinite(np.delete(found.positions, HEAD, axis=0)).all()


def test_the_settings_choose_the_fusion():
    unsure = frame_set(1.0, standing()[None], confidence=0.5)
    assert not make_fusion(parse_settings("raw")).fuse(unsure).used.any()
    assert make_fusion(parse_settings("raw", ["confidence_threshold=0.4"])).fuse(unsure).used.all()
    assert make_fusion(parse_settings("studio")).fuse(unsure).used.all()
