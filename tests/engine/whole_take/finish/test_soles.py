"""A finished take stands on the floor with its soles."""

import numpy as np
import pytest

from studio.engine.edits.edit import PinEdit
from studio.engine.edits.pins import Pins
from studio.engine.model.human.humanoid import build_humanoid
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import INDEX, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.seeing.fitting.cones import SHAPE, performer_of
from studio.engine.whole_take.finish.contact.contacts import JOINTS, find_contacts
from studio.engine.whole_take.finish.contact.soles import GIVES_M, Soles, feet_of, lift_m, without_dips
from studio.engine.whole_take.finish.known import Known
from studio.engine.whole_take.finish.trajectory import Kinematics

REST_M = np.array([0.08, 0.04, 0.08, 0.04])
DT = 1 / 60


def _contacts(feet):
    return find_contacts(feet, [(0, len(feet))], DT, REST_M)


@pytest.mark.parametrize("off_m", [0.02, -0.03])
def test_a_take_that_hovers_or_sinks_is_brought_to_the_floor(off_m):
    """In the T-pose the ball of the foot is 2 cm above the sole, as in exports."""
    humanoid = build_humanoid(Skeleton.of(performer_of(np.zeros(len(SHAPE)))))
    joints = [INDEX[name] for name in ("left_ankle", "left_toe", "right_ankle", "right_toe")]
    rest_m = humanoid.skeleton.rest_positions_m[OUTPUT_OF_CANONICAL_INDEX[joints]]
    q = np.tile(humanoid.rest_qpos, (90, 1))
    q[:, 7:] = 0.0
    q[:, 2] += off_m
    feet = np.tile(rest_m + np.array([0.0, 0.0, off_m]), (90, 1, 1))
    contacts = find_contacts(feet, [(0, 90)], DT, rest_m[:, 2])
    assert lift_m(feet_of(humanoid, q, rest_m[:, 2]), contacts) == pytest.approx(
        0.02 - rest_m[1, 2] - off_m, abs=1e-6
    )


@pytest.mark.parametrize(("off_m", "lifted"), [(0.05, False), (-0.12, True)])
def test_a_dancer_on_her_toes_is_not_let_down_but_lifted_out_of_the_floor(off_m, lifted):
    humanoid = build_humanoid(Skeleton.of(performer_of(np.zeros(len(SHAPE)))))
    kinematics, q = Kinematics(humanoid), np.tile(humanoid.rest_qpos, (90, 1))
    q[:, 7:] = 0.0
    for side in ("Left", "Right"):
        q[:, 7 + humanoid.model.joint(f"{side}Foot_bend").id - 1] = np.radians(40)
    joints = list(JOINTS)
    rest_m = humanoid.skeleton.rest_positions_m[OUTPUT_OF_CANONICAL_INDEX[joints], 2]
    q[:, 2] += off_m - (kinematics.sites(q[:1])[0, joints, 2] - rest_m).min()
    contacts = find_contacts(kinematics.sites(q)[:, joints], [(0, 90)], DT, rest_m)
    assert (contacts.hold > 0.0).all()
    found = lift_m(feet_of(humanoid, q, rest_m), contacts)
    assert found > 0.05 if lifted else found == 0.0


def test_a_take_without_a_stance_is_not_moved():
    humanoid = build_humanoid(Skeleton.of(performer_of(np.zeros(len(SHAPE)))))
    feet = np.zeros((30, 4, 3))
    feet[:, :, 0] = np.linspace(0.0, 2.0, 30)[:, None]
    contacts = _contacts(feet)
    assert lift_m(feet_of(humanoid, np.tile(humanoid.rest_qpos, (30, 1)), REST_M), contacts) == 0.0


def test_a_swinging_foot_that_dips_into_the_floor_is_raised_and_not_the_take():
    humanoid = build_humanoid(Skeleton.of(performer_of(np.zeros(len(SHAPE)))))
    kinematics, joints = Kinematics(humanoid), list(JOINTS)
    rest_m = humanoid.skeleton.rest_positions_m[OUTPUT_OF_CANONICAL_INDEX[joints], 2]
    q = np.tile(humanoid.rest_qpos, (90, 1))
    q[:, 7:] = 0.0
    contacts = find_contacts(kinematics.sites(q)[:, joints], [(0, 90)], DT, rest_m)
    lifted_m = lift_m(feet_of(humanoid, q, rest_m), contacts)
    q[45, 7 + humanoid.model.joint("RightFoot_bend").id - 1] = np.radians(20)
    found = without_dips(feet_of(humanoid, q, rest_m), contacts)
    raised = found.least_m > contacts.least_m
    sunk_m = rest_m[1] - kinematics.sites(q[45:46])[0, joints[3], 2]
    assert raised[45, 3] and not np.delete(raised, 45, axis=0).any()
    assert found.least_m[45, 3] > rest_m[1] - GIVES_M - 0.002 > rest_m[1] - sunk_m
    assert lift_m(feet_of(humanoid, q, rest_m), contacts) == pytest.approx(lifted_m, abs=1e-3)


def test_feet_are_the_joints_that_the_take_is_solved_with():
    """One pass through the kinematics gives the same as two passes, to the last bit."""
    humanoid = build_humanoid(Skeleton.of(performer_of(np.zeros(len(SHAPE)))))
    q = np.tile(humanoid.rest_qpos, (20, 1)) + np.random.default_rng(1).normal(scale=0.2, size=(20, 1))
    feet = feet_of(humanoid, q, REST_M)
    assert np.array_equal(feet.joints_m, Kinematics(humanoid).sites(q)[:, list(JOINTS)])
    flat = feet_of(humanoid, np.tile(humanoid.rest_qpos, (1, 1)) * (np.arange(humanoid.model.nq) < 7), REST_M)
    np.testing.assert_allclose(flat.joints_m[0, :, 2] - flat.soles_m[0], REST_M - 0.02, atol=1e-9)


def test_a_foot_that_was_pinned_too_low_is_raised_to_the_floor():
    """The pin of the right foot puts its sole 4 cm under the floor for some frames."""
    feet = np.tile(
        np.array([[0.1, 0.0, 0.08], [0.1, -0.1, 0.04], [-0.1, 0.0, 0.08], [-0.1, -0.1, 0.04]]), (90, 1, 1)
    )
    contacts = _contacts(feet)
    soles = np.zeros((90, 4))
    soles[40:43, 2:] = -0.04 - GIVES_M
    edits = [
        PinEdit(id=side, joint=f"{side}_ankle", place_m=(0.1, 0.0, 0.04), start_s=0.0, end_s=90 * DT)
        for side in ("left", "right")
    ]
    known = Known(Pins(edits), np.arange(90) * DT, DT, 1.75)
    known.raise_feet(Soles(feet, soles), contacts)
    assert known.pinned is not None
    height_m = known.pinned.place_m[:, [INDEX["left_ankle"], INDEX["right_ankle"]], 2]
    assert height_m[:, 0] == pytest.approx(0.04) and height_m[:40, 1] == pytest.approx(0.04)
    assert height_m[40:43, 1] == pytest.approx(0.08, abs=0.002)
