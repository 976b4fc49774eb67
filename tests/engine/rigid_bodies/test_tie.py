"""Bodies on joints and in hands, from known motion: their offsets and place are recovered, and what they pin."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.base.errors import SettingsError
from studio.engine.edits.edit import PinEdit
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.model.joints import INDEX, OUTPUT_INDEX
from studio.engine.model.rigid_body import RigidShape
from studio.engine.rigid_bodies.known import BodyPlace, Tie, shape_of
from studio.engine.rigid_bodies.pins import SIGMA_M, BodyPins
from studio.engine.rigid_bodies.props import held_spans, prop_poses
from studio.engine.rigid_bodies.tie import joint_places_m, measure_ties
from studio.engine.rigid_bodies.tracks import BodyTrack
from tests import poses_factory

OFFSETS = {"Cap": (0.03, -0.09, -0.08), "Glove": (0.02, 0.04, -0.05)}
JOINTS = {"Cap": ("Head", "head"), "Glove": ("RightHand", "right_wrist")}
PLACE = BodyPlace(0.7, -1.1, 0.05, 118.0)
LATE_S = 0.03


@pytest.fixture(scope="module")
def motion():
    return poses_factory.random_poses(np.random.default_rng(4), seconds=20.0)


def body(motion, name: str, place: BodyPlace = PLACE, noise_m: float = 0.003) -> BodyTrack:
    """A body on a joint of the motion, as its own system reports it, `LATE_S` late at 100 Hz."""
    joint, canonical = JOINTS[name]
    random = np.random.default_rng(7)
    turns = motion.rotations_wxyz[:, OUTPUT_INDEX[joint]]
    joints = canonical_positions(motion)[:, INDEX[canonical]]
    origin = joints - Rotation.from_quat(turns[:, [1, 2, 3, 0]]).apply(OFFSETS[name])
    track = BodyTrack(motion.time_s, origin, turns)
    times = np.arange(motion.time_s[0], motion.time_s[-1], 0.01)
    positions, rotations = track.filled_at(times)
    back = Rotation.from_euler("z", -place.yaw_deg, degrees=True)
    positions = back.apply(positions - [place.x_m, place.y_m, place.z_m])
    wxyz = (back * Rotation.from_quat(rotations[:, [1, 2, 3, 0]])).as_quat()[:, [3, 0, 1, 2]]
    return BodyTrack(times + LATE_S, positions + random.normal(0.0, noise_m, positions.shape), wxyz)


def test_place_delay_and_offsets_are_found_again(motion):
    random = np.random.default_rng(2)
    tracks = {name: body(motion, name) for name in OFFSETS}
    joints = {}
    for name, (_, canonical) in JOINTS.items():
        solved = canonical_positions(motion)[:, INDEX[canonical]]
        joints[name] = solved + random.normal(0.0, 0.02, solved.shape)  # a solve's own error
        joints[name][::50] += 0.4  # and its outliers
    found = measure_ties(motion.time_s, joints, tracks)
    place = found.place
    assert (place.x_m, place.y_m, place.z_m) == pytest.approx((0.7, -1.1, 0.05), abs=0.012)
    assert place.yaw_deg == pytest.approx(118.0, abs=0.4)
    assert found.later_s == pytest.approx(-LATE_S, abs=0.006)
    for name, tie in found.ties.items():
        assert tie.offset_m == pytest.approx(OFFSETS[name], abs=0.012)
        assert tie.residual_mm < 40

    kept = measure_ties(motion.time_s, joints, tracks, place=PLACE)
    assert kept.place == PLACE and kept.ties["Cap"].offset_m == pytest.approx(OFFSETS["Cap"], abs=0.008)


def test_a_body_pins_its_joint_where_it_is_seen(motion):
    track = body(motion, "Cap").placed(PLACE).later(-LATE_S)
    gap = (track.time_s > 5.0) & (track.time_s < 8.0)
    track = BodyTrack(track.time_s[~gap], track.positions_m[~gap], track.rotations_wxyz[~gap])
    tie = Tie(OFFSETS["Cap"], 1.0)
    pins = BodyPins((), None, {"head": (track, tie)})
    told = pins.at(motion.time_s, 1 / 60)
    seen = told.information[:, INDEX["head"]] > 0
    assert not seen[(motion.time_s > 5.1) & (motion.time_s < 7.9)].any() and seen.mean() > 0.8
    away = told.place_m[seen, INDEX["head"]] - canonical_positions(motion)[seen, INDEX["head"]]
    assert np.sqrt((away**2).sum(axis=1)).max() < 0.02
    one = pins.between(2.0, 2.0 + 1 / 60)
    assert one is not None and one.information[INDEX["head"]] == pytest.approx(1 / SIGMA_M**2)
    assert pins.between(6.0, 6.0 + 1 / 60) is None and bool(pins)
    np.testing.assert_array_equal(joint_places_m(track, tie, np.array([6.0])), np.full((1, 3), np.nan))

    pin = PinEdit(id="e1", start_s=2.0, end_s=3.0, joint="head", place_m=(0.0, 0.0, 2.0))
    both = BodyPins([pin], None, {"head": (track, tie)}).at(np.array([2.5]), 1 / 60)
    assert np.linalg.norm(both.place_m[0, INDEX["head"]] - [0.0, 0.0, 2.0]) < 0.15  # an edit counts more


def test_a_prop_is_tied_to_the_hand_that_holds_it(motion):
    """A stick in the right hand, which its system reports 3 cm off and shaking, until it is put down."""
    hand = canonical_positions(motion)[:, INDEX["right_hand"]]
    turns = motion.rotations_wxyz[:, OUTPUT_INDEX["RightHand"]]
    rotation = Rotation.from_quat(turns[:, [1, 2, 3, 0]])
    random = np.random.default_rng(5)
    held = motion.time_s < 12.0
    gap = (motion.time_s > 4.0) & (motion.time_s < 4.8)  # it is unseen, and moves with the hand
    seen_m = hand - rotation.apply([0.0, 0.02, 0.2]) + [0.03, 0.0, 0.0] + random.normal(0, 0.004, hand.shape)
    seen_m[~held] = [5.0, 5.0, 0.0]
    track = BodyTrack(motion.time_s[~gap], seen_m[~gap], turns[~gap])
    stick = prop_poses("Stick", track, shape_of("cylinder:3,60"), [motion])
    assert stick.joint_names == ("Stick", "Stick_end")
    np.testing.assert_allclose(
        np.linalg.norm(stick.positions_m[:, 1] - stick.positions_m[:, 0], axis=1), 0.3, atol=1e-6
    )
    grip = rotation.inv().apply(hand - stick.positions_m[:, 0])
    inside = (motion.time_s > 0.5) & (motion.time_s < 11.5)
    assert np.ptp(grip[inside], axis=0).max() < 1e-6  # one grip while it is held, even where it is unseen
    apart = Rotation.from_quat(stick.rotations_wxyz[inside, 0][:, [1, 2, 3, 0]]).inv() * rotation[inside]
    assert np.degrees(apart.magnitude()).max() < 0.1
    assert not stick.confidence[gap].any()
    down = stick.positions_m[motion.time_s > 12.5, 0]
    np.testing.assert_allclose(down, np.broadcast_to([5.0, 5.0, 0.0], down.shape))


def test_a_short_touch_holds_nothing():
    away = np.full(100, 1.0)
    away[10:15], away[40:80] = 0.05, 0.05
    seen = np.ones(100, bool)
    assert held_spans(away, seen, 18, 8) == [(40, 80)]
    seen[50:55] = False
    away[50:55] = 3.0  # where it was unseen, its place is unknown
    assert held_spans(away, seen, 18, 8) == [(40, 80)]
    assert held_spans(away, seen, 18, 3) == [(55, 80)]


def test_shapes_of_texts():
    assert shape_of("box:10,20,30").edges_m == pytest.approx([0.1, 0.2, 0.3])
    assert shape_of("cylinder:3,60,x") == RigidShape("cylinder", (3.0, 60.0), "x")
    assert shape_of("sphere:22").edges_m == pytest.approx([0.22] * 3)
    for wrong in ("cone:1,2", "box:1,2", "sphere:-1", "cylinder:1,nan", "sphere:"):
        with pytest.raises(SettingsError) as caught:
            shape_of(wrong)
        assert caught.value.code == "settings.value"
