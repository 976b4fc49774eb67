"""Hands: fingers open and close by the hand states."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.model.frames import HandSeen
from studio.engine.model.human.ranges import dofs_of
from studio.engine.model.human.skeleton import Skeleton, forward_positions, local_rotations
from studio.engine.model.joints import FINGERS, OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.solve.completion.hands import FASTEST_PER_S, Hands
from tests.engine.walkers import performer

DT = 1 / 60
SKELETON = Skeleton.of(performer())


def reach_m(rotations, side="Left", finger="Middle"):
    """Distance of the finger's last joint from the wrist [m]."""
    joints = forward_positions(SKELETON, np.zeros(3), rotations)
    return float(
        np.linalg.norm(joints[OUTPUT_INDEX[f"{side}Hand{finger}3"]] - joints[OUTPUT_INDEX[f"{side}Hand"]])
    )


def run(hands, seen, seconds=1.5):
    """Rotations after the state was seen for this long."""
    for _ in range(round(seconds / DT)):
        rotations = np.tile(np.eye(3), (len(OUTPUT_JOINTS), 1, 1))
        hands.apply(rotations, seen, DT)
    return rotations


def seen(probability, side="left", method="shape"):
    return (HandSeen(side, method, probability),)


def test_an_open_hand_is_flat_and_a_closed_one_a_fist():
    opened, closed = run(Hands("shape"), seen(1.0)), run(Hands("shape"), seen(0.0))
    for finger in FINGERS:
        rest = float(
            np.linalg.norm(sum(SKELETON.offsets_m[OUTPUT_INDEX[f"LeftHand{finger}{k}"]] for k in (1, 2, 3)))
        )
        assert reach_m(opened, finger=finger) == pytest.approx(rest, abs=1e-3), finger
        if finger != "Thumb":
            assert reach_m(closed, finger=finger) < 0.85 * rest, finger
    tip = forward_positions(SKELETON, np.zeros(3), closed)[OUTPUT_INDEX["LeftHandMiddle3"]]
    knuckle = forward_positions(SKELETON, np.zeros(3), closed)[OUTPUT_INDEX["LeftHandMiddle1"]]
    assert tip[2] < knuckle[2] - 0.01, "the palm is down in the T-pose: fingers close downward"


def test_both_hands_close_as_mirror_images():
    both = run(Hands("shape"), seen(0.2) + seen(0.2, "right"))
    joints = forward_positions(SKELETON, SKELETON.rest_positions_m[0], both)
    for name, i in OUTPUT_INDEX.items():
        if name.startswith("LeftHand"):
            mirrored = joints[OUTPUT_INDEX["Right" + name[4:]]] * [-1, 1, 1]
            assert joints[i] == pytest.approx(mirrored, abs=1e-9), name


def test_it_is_smooth():
    hands = Hands("shape")
    run(hands, seen(1.0))
    lengths = [reach_m(run(hands, seen(0.0), DT)) for _ in range(60)]
    steps = np.diff(lengths)
    assert (steps <= 1e-9).all() and np.abs(steps).max() < 0.02
    assert lengths[2] > lengths[-1] + 0.03, "not at once"


def test_a_hand_of_unknown_state_is_a_little_bent_and_the_other_hand_is_not_concerned():
    relaxed = run(Hands("shape"), ())
    assert (
        reach_m(run(Hands("shape"), seen(0.0))) < reach_m(relaxed) < reach_m(run(Hands("shape"), seen(1.0)))
    )
    assert reach_m(run(Hands("shape"), seen(0.0)), "Right") == pytest.approx(reach_m(relaxed, "Right"))


def test_only_its_own_method_counts():
    circles = seen(1.0, method="circles")
    assert reach_m(run(Hands("shape"), circles)) == pytest.approx(reach_m(run(Hands("shape"), ())))
    assert reach_m(run(Hands("circles"), circles)) == pytest.approx(reach_m(run(Hands("shape"), seen(1.0))))


def test_the_surer_camera_weighs_more_and_no_opinion_nothing():
    unsure = seen(1.0) + seen(0.45)
    assert reach_m(run(Hands("shape"), unsure)) > 0.97 * reach_m(run(Hands("shape"), seen(1.0)))
    assert reach_m(run(Hands("shape"), seen(0.5))) == pytest.approx(reach_m(run(Hands("shape"), ())))


def test_other_joints_are_not_turned():
    rotations = run(Hands("shape"), seen(0.0))
    others = [i for i, n in enumerate(OUTPUT_JOINTS) if "Hand" not in n or n in ("LeftHand", "RightHand")]
    assert np.array_equal(rotations[others], np.tile(np.eye(3), (len(others), 1, 1)))


def test_a_fist_keeps_its_shape_where_the_state_is_lost_and_slowly_relaxes():
    hands = Hands("shape")
    fist, relaxed = reach_m(run(hands, seen(0.0))), reach_m(run(Hands("shape"), ()))
    assert reach_m(run(hands, (), 0.2)) < fist + 0.15 * (relaxed - fist)
    assert reach_m(run(hands, (), 10.0)) == pytest.approx(relaxed, abs=2e-3)


def test_the_thesiss_method_keeps_the_last_state():
    hands = Hands("circles")
    fist = reach_m(run(hands, seen(0.0, method="circles")))
    assert reach_m(run(hands, (), 10.0)) == pytest.approx(fist)


@pytest.mark.parametrize("dt", [1 / 120, 1 / 30, 0.1])
def test_no_finger_turns_faster_than_a_hand_can(dt):
    hands, last = Hands("shape"), None
    for k in range(round(1.0 / dt)):
        rotations = np.tile(np.eye(3), (len(OUTPUT_JOINTS), 1, 1))
        hands.apply(rotations, seen(float(k % 3 == 0)), dt)
        local = local_rotations(rotations)
        if last is not None:
            turn = np.einsum("jab,jab->j", last, local)  # the trace of the turn between the frames
            speed = np.arccos(np.clip((turn - 1) / 2, -1, 1)) / dt
            assert speed.max() < FASTEST_PER_S * np.radians(95) + 1e-6
        last = local


@pytest.mark.parametrize("open_probability", [0.0, 0.4, 1.0])
def test_fingers_stay_within_their_ranges_and_the_last_joint_follows(open_probability):
    local = local_rotations(run(Hands("shape"), seen(open_probability)))
    for finger in FINGERS:
        bends = []
        for k in (1, 2, 3):
            turn = Rotation.from_matrix(local[OUTPUT_INDEX[f"LeftHand{finger}{k}"]]).as_rotvec()
            dofs = dofs_of(f"LeftHand{finger}{k}")
            axes = np.array([dof.axis for dof in dofs]).T
            angles = np.degrees(np.linalg.lstsq(axes, turn)[0])
            for dof, angle in zip(dofs, angles, strict=True):
                assert dof.low_deg - 0.1 <= angle <= dof.high_deg + 0.1, f"{finger}{k} {dof.name}"
            bends.append(angles[0])  # of the bend, which comes first
        if finger != "Thumb":
            assert bends[2] == pytest.approx(2 / 3 * bends[1])


def test_the_thumb_of_a_fist_lies_over_the_fingers():
    joints = forward_positions(SKELETON, np.zeros(3), run(Hands("shape"), seen(0.0)))
    rotations = run(Hands("shape"), seen(0.0))
    thumb = OUTPUT_INDEX["LeftHandThumb3"]
    tip = joints[thumb] + rotations[thumb] @ SKELETON.finger_tip_m("LeftHandThumb3")
    middle = 0.5 * (joints[OUTPUT_INDEX["LeftHandIndex2"]] + joints[OUTPUT_INDEX["LeftHandIndex3"]])
    assert np.linalg.norm(tip - middle) < 0.03
    assert tip[2] < joints[OUTPUT_INDEX["LeftHandIndex1"]][2] - 0.02, "on the palm's side"
