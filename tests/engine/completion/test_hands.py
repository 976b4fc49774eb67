"""Hands: fingers open and close by the hand states."""

import numpy as np
import pytest

from studio.engine.completion.hands import Hands
from studio.engine.frames import HandSeen
from studio.engine.human.skeleton import Skeleton, forward_positions
from studio.engine.joints import FINGERS, OUTPUT_INDEX, OUTPUT_JOINTS
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
    """Rotations after the state was seen for so long."""
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
