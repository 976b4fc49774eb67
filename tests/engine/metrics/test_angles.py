"""Joint angles of bodies that are built from known rotations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from studio.engine.metrics.figures.angles import ANGLES, joint_angle_errors_deg, joint_angles_deg
from studio.engine.model.joints import INDEX, JOINT_COUNT

# stage (x, y, z) of a performer who faces -y, from ISB's axes (x forward, y up, z to the right)
STAGE_ISB = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
RIGHT = {"left": -1.0, "right": 1.0}


def turn(order, *degrees):
    return Rotation.from_euler(order, degrees, degrees=True).as_matrix()


def mirrored(matrix, side):
    mirror = np.diag([1.0, 1.0, RIGHT[side]])
    return mirror @ matrix @ mirror


def body(
    thorax=None, humerus=None, elbow=0.0, thigh=None, knee=0.0, ankle=0.0, side="right", at=(1.0, -2.0, 0.9)
):
    """Canonical joints, shape (1, 21, 3), in the stage frame; rotations in ISB's axes, one side's limbs posed.

    `thorax` is relative to the pelvis, `humerus` to the thorax, `thigh` to the pelvis, all as for the right side.
    """
    thorax = np.eye(3) if thorax is None else thorax
    p = np.full((JOINT_COUNT, 3), np.nan)
    p[INDEX["hips"]], p[INDEX["spine"]] = (0, 0, 0), (0, 0.15, 0)
    p[INDEX["chest"]] = p[INDEX["spine"]] + thorax @ [0, 0.2, 0]
    p[INDEX["neck"]] = p[INDEX["spine"]] + thorax @ [0, 0.35, 0]
    p[INDEX["head"]] = p[INDEX["neck"]] + thorax @ [0, 0.2, 0]
    for each in ("left", "right"):
        posed = each == side
        p[INDEX[f"{each}_shoulder"]] = p[INDEX["neck"]] + thorax @ [0, 0, 0.2 * RIGHT[each]]
        arm = mirrored(humerus, each) if posed and humerus is not None else turn("x", -45.0 * RIGHT[each])
        upper = thorax @ arm
        fore = upper @ turn("z", elbow if posed else 30.0)
        p[INDEX[f"{each}_elbow"]] = p[INDEX[f"{each}_shoulder"]] + upper @ [0, -0.3, 0]
        p[INDEX[f"{each}_wrist"]] = p[INDEX[f"{each}_elbow"]] + fore @ [0, -0.25, 0]
        p[INDEX[f"{each}_hand"]] = p[INDEX[f"{each}_wrist"]] + fore @ [0, -0.1, 0]
        p[INDEX[f"{each}_hip"]] = (0, -0.05, 0.1 * RIGHT[each])
        leg = mirrored(thigh, each) if posed and thigh is not None else np.eye(3)
        shank = leg @ turn("z", -(knee if posed else 0.0))
        foot = shank @ turn("z", ankle if posed else 0.0)
        p[INDEX[f"{each}_knee"]] = p[INDEX[f"{each}_hip"]] + leg @ [0, -0.45, 0]
        p[INDEX[f"{each}_ankle"]] = p[INDEX[f"{each}_knee"]] + shank @ [0, -0.42, 0]
        p[INDEX[f"{each}_toe"]] = p[INDEX[f"{each}_ankle"]] + foot @ [0.15, 0, 0]
    return (p @ STAGE_ISB.T + at)[None]


def angles_of(positions):
    return dict(zip(ANGLES, joint_angles_deg(positions)[0], strict=True))


degrees = st.floats(-60, 60)
sides = st.sampled_from(["left", "right"])


@settings(max_examples=30, deadline=None)
@given(flexion=degrees, side_bend=degrees, rotation=degrees)
def test_the_trunk_turns_about_z_x_y(flexion, side_bend, rotation):
    found = angles_of(body(turn("ZXY", -flexion, side_bend, rotation)))
    assert found["trunk_flexion"] == pytest.approx(flexion, abs=1e-9)
    assert found["trunk_side"] == pytest.approx(side_bend, abs=1e-9)
    assert found["trunk_rotation"] == pytest.approx(rotation, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(
    side=sides,
    plane=st.floats(-80, 120),
    elevation=st.floats(25, 150),
    rotation=degrees,
    elbow=st.floats(30, 140),
)
def test_the_arm_turns_about_y_x_y(side, plane, elevation, rotation, elbow):
    """Elevation is a negative turn about x (Wu et al. 2005)."""
    found = angles_of(body(humerus=turn("YXY", plane, -elevation, rotation), elbow=elbow, side=side))
    assert found[f"{side}_shoulder_plane"] == pytest.approx(plane, abs=1e-9)
    assert found[f"{side}_shoulder_elevation"] == pytest.approx(elevation, abs=1e-9)
    assert found[f"{side}_shoulder_rotation"] == pytest.approx(rotation, abs=1e-9)
    assert found[f"{side}_elbow_flexion"] == pytest.approx(elbow, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(side=sides, flexion=st.floats(-30, 110), abduction=degrees, rotation=degrees, knee=st.floats(30, 120))
def test_the_leg_turns_about_z_x_y(side, flexion, abduction, rotation, knee):
    thigh = turn("ZXY", flexion, -abduction, rotation)
    found = angles_of(body(thigh=thigh, knee=knee, ankle=12.0, side=side))
    assert found[f"{side}_hip_flexion"] == pytest.approx(flexion, abs=1e-9)
    assert found[f"{side}_hip_abduction"] == pytest.approx(abduction, abs=1e-9)
    assert found[f"{side}_hip_rotation"] == pytest.approx(rotation, abs=1e-9)
    assert found[f"{side}_knee_flexion"] == pytest.approx(knee, abs=1e-9)
    assert found[f"{side}_ankle_dorsiflexion"] == pytest.approx(12.0, abs=1e-9)


def test_what_a_straight_limb_does_not_show_is_left_out():
    found = angles_of(body(humerus=turn("x", -90.0), elbow=5.0, knee=5.0))
    assert np.isnan(found["right_shoulder_rotation"]) and np.isnan(found["right_hip_rotation"])
    assert found["right_elbow_flexion"] == pytest.approx(5.0, abs=1e-9)
    hanging = angles_of(body(humerus=turn("x", -5.0), elbow=40.0))
    assert np.isnan(hanging["right_shoulder_plane"])
    straight = angles_of(body(knee=1e-170, at=(0.0, 0.0, 0.0)))  # the square of its sine is nothing
    assert np.isnan(straight["right_hip_rotation"]) and straight["right_knee_flexion"] == pytest.approx(0.0)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**16))
def test_angles_do_not_depend_on_where_the_body_is(seed):
    pose = body(
        turn("ZXY", 20, 10, 5), humerus=turn("YXY", 40, -70, 20), elbow=60, thigh=turn("z", 40), knee=50
    )
    moved = pose @ Rotation.random(random_state=seed).as_matrix().T + [3.0, -1.0, 2.0]
    assert np.allclose(joint_angles_deg(moved), joint_angles_deg(pose), atol=1e-9, equal_nan=True)


def test_errors_are_wrapped_and_their_offset_is_told():
    a = np.concatenate([body(humerus=turn("YXY", 175, -60, 0), elbow=e) for e in (50, 70)])
    b = np.concatenate([body(humerus=turn("YXY", -175, -60, 0), elbow=e) for e in (40, 80)])
    errors = joint_angle_errors_deg(a, b)
    assert errors["right_shoulder_plane"]["error_deg"] == pytest.approx(10.0, abs=1e-9)
    assert errors["right_shoulder_plane"]["offset_deg"] == pytest.approx(-10.0, abs=1e-9)
    assert errors["right_elbow_flexion"] == pytest.approx({"error_deg": 10.0, "offset_deg": 0.0}, abs=1e-9)
