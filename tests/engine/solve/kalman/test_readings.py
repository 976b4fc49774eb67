import numpy as np
import pytest

from studio.engine.model.frames import Reading
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX, JOINT_COUNT, MIRROR, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.solve.kalman.readings import INSIST_S, LOST_S, Gate, ReadingRows
from tests.engine.torture import PERFORMER

JOINTS = Skeleton.of(PERFORMER).rest_positions_m[OUTPUT_OF_CANONICAL_INDEX]
STILL = np.zeros((JOINT_COUNT, 3))
CAMERAS = np.array([[0.0, -3.5, 1.0], [3.5, 0.0, 1.6]])
SPREAD = np.tile(1e-4 * np.eye(3), (JOINT_COUNT, 1, 1))
WRIST = INDEX["left_wrist"]
STEP_S = 1 / 30


def reading(joints, camera=0, offset_s=0.0):
    return Reading(camera, offset_s, joints, np.full(JOINT_COUNT, 0.95))


def gated(gate, *readings, velocities=STILL):
    rows = gate.rows(readings, CAMERAS, JOINTS, velocities, 0.0)
    again = gate.choose(rows, JOINTS, lambda: SPREAD, STEP_S)
    return rows, again


@pytest.fixture
def gate():
    return Gate(np.ones(JOINT_COUNT))


def test_joints_where_they_are_expected_are_used(gate):
    rows, again = gated(gate, reading(JOINTS), reading(JOINTS, 1))
    assert rows.used.all() and not again.any()


def test_readings_come_to_one_instant_along_the_bodys_motion(gate):
    velocity = np.tile([2.0, 0.0, 0.0], (JOINT_COUNT, 1))
    rows, _ = gated(gate, reading(JOINTS + 0.01 * velocity, 0, 0.01), velocities=velocity)
    np.testing.assert_allclose(rows.positions[0], JOINTS, atol=1e-12)


def test_a_camera_that_has_left_for_right_is_turned_round(gate):
    rows, _ = gated(gate, reading(JOINTS[MIRROR]), reading(JOINTS, 1))
    assert gate.exchanged.tolist() == [True, False]
    np.testing.assert_allclose(rows.positions[0], JOINTS)


def off(metres=1.0):
    joints = JOINTS.copy()
    joints[WRIST] += [metres, 0.0, 0.0]
    return joints


def test_a_spike_is_left_out(gate):
    rows, _ = gated(gate, reading(off()))
    assert not rows.used[0, WRIST] and rows.used[0].sum() == JOINT_COUNT - 1
    assert (rows.information[0, WRIST] == 0.0).all()


def test_a_joint_that_all_cameras_report_elsewhere_is_believed_again(gate):
    k, again = 0, np.zeros(JOINT_COUNT, dtype=bool)
    while k < 30 and not again.any():
        k += 1
        rows, again = gated(gate, reading(off()), reading(off(), 1))
    assert np.flatnonzero(again).tolist() == [WRIST] and rows.used[:, WRIST].all()
    assert k * STEP_S == pytest.approx(INSIST_S, abs=2 * STEP_S)


def test_a_joint_that_one_camera_confirms_is_never_believed_elsewhere(gate):
    for _ in range(60):
        rows, again = gated(gate, reading(off()))
        assert not rows.used[0, WRIST] and not again.any()
        gated(gate, reading(JOINTS, 1))


def test_a_performer_who_is_elsewhere_is_noticed(gate):
    seen = np.ones(JOINT_COUNT, dtype=bool)
    k = 0
    while k < 10 and not gate.lost(seen):
        k += 1
        gated(gate, reading(JOINTS + np.array([2.0, 0.0, 0.0])))
    assert k * STEP_S <= LOST_S + 2 * STEP_S
    gate.forget()
    assert not gate.lost(seen)


def test_what_is_further_off_counts_less():
    joints = JOINTS.copy()
    joints[WRIST, 0] += 0.1
    rows = ReadingRows(joints[None], np.tile(1e4 * np.eye(3), (1, JOINT_COUNT, 1, 1)), np.ones(JOINT_COUNT))
    information, pull, share = rows.pull(JOINTS)
    assert share[0, WRIST] < 0.1 and share[0, INDEX["hips"]] == 1.0
    np.testing.assert_allclose(information[WRIST], share[0, WRIST] * 1e4 * np.eye(3))
    np.testing.assert_allclose(pull[WRIST], [share[0, WRIST] * 1e3, 0.0, 0.0])


def test_unseen_joints_and_those_of_no_reach_tell_nothing():
    joints, reach = JOINTS.copy(), np.ones(JOINT_COUNT)
    joints[WRIST], reach[INDEX["head"]] = np.nan, 0.0
    rows = ReadingRows(joints[None], np.tile(1e4 * np.eye(3), (1, JOINT_COUNT, 1, 1)), reach)
    information, pull, _ = rows.pull(JOINTS)
    for joint in (WRIST, INDEX["head"]):
        assert (information[joint] == 0.0).all() and (pull[joint] == 0.0).all()
    middle, weights = rows.middle()
    assert np.isnan(middle[WRIST]).all() and weights[WRIST] == 0.0
