"""Left and right, distinguished by where the feet point and how the knees bend."""

import numpy as np

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.model.joints import INDEX, MIRROR
from studio.engine.solve.fusion.facing import Facing, exchanged_at_first, forwardness

JOINTS = demo_motion().positions_m[0]  # a T-pose


def test_feet_point_forward_and_with_names_exchanged_backward():
    assert forwardness(JOINTS) > 0.8
    assert forwardness(JOINTS[MIRROR]) < -0.8


def test_a_performer_who_bends_tells_nothing():
    bent = JOINTS.copy()
    bent[INDEX["neck"]] = bent[INDEX["hips"]] + [0.0, -0.5, 0.1]
    assert np.isnan(forwardness(bent))


def test_knees_of_a_performer_who_sits_tell():
    sitting = JOINTS.copy()
    sitting[INDEX["neck"]] = sitting[INDEX["hips"]] + [0.0, -0.5, 0.1]
    for side in ("left", "right"):
        hip, knee, ankle = (INDEX[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle"))
        sitting[knee] = sitting[hip] + np.array([0.0, -0.4, 0.0])
        sitting[ankle] = sitting[knee] + np.array([0.0, 0.0, -0.4])
    assert forwardness(sitting) > 0.9
    assert forwardness(sitting[MIRROR]) < -0.9


def test_the_whole_demo_faces_forward_whenever_it_can_be_told():
    ahead = forwardness(demo_motion().positions_m[::10])
    assert np.nanmin(ahead) > 0.0 and np.isfinite(ahead).mean() > 0.7


def test_at_first_the_cameras_agree_and_face_forward():
    confidence = np.full((3, 21), 0.9)
    for exchanged in ([False, True, False], [True, True, False], [True, True, True], [False, False, False]):
        seen = np.where(np.array(exchanged)[:, None, None], JOINTS[MIRROR], JOINTS)
        assert exchanged_at_first(seen, confidence).tolist() == exchanged


def test_feet_that_nobody_is_sure_of_decide_nothing():
    confidence = np.full((1, 21), 0.4)
    assert exchanged_at_first(JOINTS[MIRROR][None], confidence).tolist() == [False]


def test_the_watch_says_so_once_a_skeleton_has_faced_backwards_for_a_while():
    watch = Facing()
    said = [watch.backwards(JOINTS[MIRROR], 1 / 60) for _ in range(60)]
    assert said.count(True) == 1 and 0.2 < said.index(True) / 60 < 0.9
    assert not any(watch.backwards(JOINTS, 1 / 60) for _ in range(60))
