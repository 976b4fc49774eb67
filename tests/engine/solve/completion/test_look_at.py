"""Look-at: the head turns to its target, smoothly and within the neck's range, and keeps its place."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.base.geometry import quaternions
from studio.engine.model.human.angles import configuration_of
from studio.engine.model.human.skeleton import Skeleton, forward_positions
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.solve.completion.look_at import FASTEST_RAD_S, LookAt
from tests.engine.walkers import humanoid, performer

DT = 1 / 60
SKELETON = Skeleton.of(performer())
HEAD, NECK = OUTPUT_INDEX["Head"], OUTPUT_INDEX["Neck"]
AHEAD_M = (0.0, -2.0, 1.6)
LIMIT_TOLERANCE_RAD = np.radians(0.1)


def upright(yaw_rad=0.0):
    return np.tile(Rotation.from_euler("z", yaw_rad).as_matrix(), (len(OUTPUT_JOINTS), 1, 1))


def run(look_at, body=None, *, seconds=2.0, head=None):
    """Positions and rotations after looking for this long, each frame from the solved pose `body`."""
    body = upright() if body is None else body
    for _ in range(max(1, round(seconds / DT))):
        rotations = body.copy()
        positions = forward_positions(SKELETON, np.array([0.0, 0.0, 1.0]), rotations)
        look_at.apply(positions, rotations, head, DT)
    return forward_positions(SKELETON, np.array([0.0, 0.0, 1.0]), rotations), rotations


def gaze(rotations):
    return -rotations[HEAD][:, 1]


@pytest.mark.parametrize("target", [(0.0, -3.0, 1.6), (1.5, -2.0, 1.2), (-2.0, -1.5, 1.9), (0.6, -1.6, 1.1)])
def test_point_is_looked_at(target):
    positions, rotations = run(LookAt("point", target))
    wanted = np.array(target) - positions[HEAD]
    assert np.degrees(np.arccos(gaze(rotations) @ wanted / np.linalg.norm(wanted))) < 4


def test_far_looks_ahead_near_at_the_floor_and_hands_at_the_hands():
    for yaw in (0.0, 2.0):
        _, rotations = run(LookAt("far", AHEAD_M), upright(yaw))
        assert gaze(rotations) == pytest.approx([np.sin(yaw), -np.cos(yaw), 0], abs=0.02)
    _, rotations = run(LookAt("near", AHEAD_M))
    assert gaze(rotations)[2] < -0.4 and abs(gaze(rotations)[0]) < 0.02
    body = upright()
    for side, sign in (("Left", 1.0), ("Right", -1.0)):  # arms forward and to the left
        turn = Rotation.from_euler("z", -sign * np.pi / 2).as_matrix()
        turn = Rotation.from_euler("z", 0.4).as_matrix() @ turn
        for part in ("Arm", "ForeArm", "Hand"):
            body[OUTPUT_INDEX[side + part]] = turn
    _, rotations = run(LookAt("hands", AHEAD_M), body)
    assert gaze(rotations)[0] > 0.2 and gaze(rotations)[2] < 0


def test_a_measured_head_is_followed_and_far_serves_where_there_is_none():
    turned = Rotation.from_euler("zx", [0.6, 0.2])
    head = tuple(float(v) for v in quaternions(turned.as_matrix()))
    _, rotations = run(LookAt("measured", AHEAD_M), head=head)
    assert gaze(rotations) @ -turned.as_matrix()[:, 1] > np.cos(np.radians(4))
    _, rotations = run(LookAt("measured", AHEAD_M))
    assert gaze(rotations) == pytest.approx([0, -1, 0], abs=0.02)


def test_a_followed_face_turns_nods_and_tilts_without_delay():
    turned = Rotation.from_euler("ZXY", [0.5, -0.2, 0.25]).as_matrix()
    look_at, body = LookAt("measured", AHEAD_M), upright()
    positions = forward_positions(SKELETON, np.array([0.0, 0.0, 1.0]), body)
    for dt in (0.0, DT):
        rotations = body.copy()
        look_at.apply(positions, rotations, None, dt, turned)
        off = Rotation.from_matrix(rotations[HEAD].T @ turned).magnitude()
        assert off < np.radians(2)
    assert np.allclose(look_at.straight(body), np.eye(3))
    rotations = body.copy()
    look_at.apply(positions, rotations, None, DT, Rotation.from_euler("z", -1.0).as_matrix())
    step = Rotation.from_matrix(rotations[HEAD].T @ turned).magnitude()
    assert 0.05 < step < 2 * FASTEST_RAD_S * DT  # no faster than a head


TARGETS = [
    (2.0, -0.5, 1.6),
    (-3.0, 0.0, 0.0),
    (0.0, 3.0, 1.6),
    (0.1, -0.2, 5.0),
    (0.3, -0.3, 0.0),
    (0.0, 0.0, 1.55),
]


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("twist_deg", [0, 35])
def test_head_and_neck_stay_within_their_ranges(target, twist_deg):
    """Includes a neck that the solve has turned already."""
    body = upright()
    body[NECK] = body[HEAD] = Rotation.from_euler("z", twist_deg, degrees=True).as_matrix()
    human = humanoid()
    low, high = human.range_rad.T
    for direction in (1, -1):
        _, rotations = run(LookAt("point", (direction * target[0], *target[1:])), body)
        q = configuration_of(human, np.zeros(3), rotations, limited=False)[7:]
        for k in range(len(q)):
            name = human.model.joint(k + 1).name
            if name.startswith(("Neck", "Head")):
                excess = max(low[k] - q[k], q[k] - high[k])
                assert excess < LIMIT_TOLERANCE_RAD, f"{name} {np.degrees(q[k]):.1f} degrees"


@pytest.mark.parametrize("mode", ["far", "near", "hands", "point"])
def test_the_head_joint_stays_in_place(mode):
    body = upright()
    body[NECK] = body[HEAD] = Rotation.from_euler("xy", [0.2, 0.1]).as_matrix()
    before = forward_positions(SKELETON, np.array([0.0, 0.0, 1.0]), body)
    positions, rotations = run(LookAt(mode, (3.0, -1.0, 1.6)), body)
    assert np.linalg.norm(positions[HEAD] - before[HEAD]) < 1e-3
    assert np.abs(rotations @ rotations.swapaxes(1, 2) - np.eye(3)).max() < 1e-9
    others = [i for i in range(len(OUTPUT_JOINTS)) if i not in (HEAD, NECK)]
    assert np.array_equal(rotations[others], body[others])


def test_it_turns_smoothly_even_when_the_target_jumps_behind():
    look_at, last, fastest = LookAt("hands", AHEAD_M), None, 0.0
    for k in range(240):
        rotations = upright()
        positions = forward_positions(SKELETON, np.array([0.0, 0.0, 1.0]), rotations)
        angle = np.radians(170 if k < 120 else 190)
        hands = positions[HEAD] + 1.5 * np.array([np.sin(angle), -np.cos(angle), 0.0])
        positions[[OUTPUT_INDEX["LeftHand"], OUTPUT_INDEX["RightHand"]]] = hands
        look_at.apply(positions, rotations, None, DT)
        if last is not None:
            turn = Rotation.from_matrix(rotations[HEAD] @ last.T).magnitude()
            fastest = max(fastest, np.degrees(turn) / DT)
        last = rotations[HEAD]
    assert fastest < 400


def test_no_time_does_not_turn():
    rotations = upright()
    LookAt("point", (3.0, -1.0, 1.0)).apply(SKELETON.rest_positions_m, rotations, None, 0.0)
    assert gaze(rotations) == pytest.approx([0, -1, 0])
