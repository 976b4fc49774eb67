"""The wire protocol: messages round trip, and nothing but FormatError comes out of bad bytes."""

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from studio import wire
from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS
from tests.refused import refused

HELLO = wire.Hello(
    protocol_version=1, name="camera_0", device="test", joint_set="kinect-v2", boot_id="b", frames_per_second=30.0,
    serial="42", intrinsics=wire.Intrinsics(500.0, 500.0, 320.0, 240.0, 640, 480), token="t",
)  # fmt: skip
FRAME = wire.skeleton_frame(
    7, 123_456_789, np.arange(75.0).reshape(25, 3), np.linspace(0, 1, 25),
    [wire.HandState("left", "shape", 0.25)], (1.0, 0.0, 0.0, 0.0),
)  # fmt: skip
MESSAGES = [
    HELLO,
    wire.Hello(protocol_version=1, name="a", device="", joint_set="canonical", boot_id=""),
    wire.Welcome(name="camera_0", reference=True),
    wire.Refused(code="version", reason="too old"),
    wire.ClockRequest(client_send_ns=1),
    wire.ClockReply(client_send_ns=1, server_receive_ns=2, server_send_ns=3),
    wire.ClockSample(client_send_ns=1, server_receive_ns=2, server_send_ns=3, client_receive_ns=4),
    FRAME,
    wire.Status(frames_sent=5, frames_dropped=1, message="fine"),
    wire.Recording(active=True, take="take_1"),
]
IDS = [f"{type(m).__name__}-{i}" for i, m in enumerate(MESSAGES)]
quickly = settings(deadline=None, max_examples=200)


def decoded_or_refused(data):
    """The message in any bytes, with its joints looked at too; None where it is refused."""
    try:
        message = wire.decode(data)
        if isinstance(message, wire.Hello):
            wire.check_hello(message)
        if isinstance(message, wire.SkeletonFrame):
            wire.joint_arrays(message, "kinect-v2")
    except FormatError:
        return None
    return message


@pytest.mark.parametrize("message", MESSAGES, ids=IDS)
def test_messages_round_trip(message):
    data = wire.encode(message)
    assert isinstance(data, bytes) and wire.decode(data) == message
    assert msgspec.msgpack.decode(data)["type"]


def test_every_kind_of_message_has_another_type():
    kinds = {msgspec.msgpack.decode(wire.encode(m))["type"] for m in MESSAGES}
    assert len(kinds) == len({type(m) for m in MESSAGES}) == 9


@pytest.mark.parametrize("joint_set", JOINT_SETS)
def test_joints_round_trip_as_float32_with_unseen_ones(joint_set):
    count, rng = len(JOINT_SETS[joint_set]), np.random.default_rng(1)
    positions, confidence = rng.normal(0, 3, (count, 3)), rng.uniform(0, 1, count)
    positions[2] = np.nan
    frame = wire.decode(wire.encode(wire.skeleton_frame(1, 2, positions, confidence)))
    back, sure = wire.joint_arrays(frame, joint_set)
    assert back.dtype == sure.dtype == np.float64
    assert np.allclose(back, positions, atol=1e-6, equal_nan=True)
    assert np.allclose(sure, confidence, atol=1e-7)


def test_a_frame_is_small():
    assert len(wire.encode(FRAME)) < 25 * 16 + 250
    plain = wire.skeleton_frame(1, 2**61, np.zeros((32, 3)), np.zeros(32))
    assert len(wire.encode(plain)) < 32 * 16 + 150


def test_not_contiguous_arrays_and_other_types_are_fine():
    positions = np.asfortranarray(np.arange(63, dtype=np.float32).reshape(21, 3))
    frame = wire.skeleton_frame(1, 2, positions[:, ::-1], np.ones(42)[::2])
    back, _ = wire.joint_arrays(frame, "canonical")
    assert np.array_equal(back, positions[:, ::-1])


@pytest.mark.parametrize("count", [0, 20, 22])
def test_a_frame_of_another_joint_set_is_refused(count):
    frame = wire.skeleton_frame(9, 2, np.zeros((count, 3)), np.zeros(count))
    with refused(FormatError, "protocol.frame_size", number=9):
        wire.joint_arrays(frame, "canonical")


@pytest.mark.parametrize("bad", [np.nan, -0.1, 1.1, np.inf])
def test_a_confidence_out_of_range_is_refused(bad):
    confidence = np.ones(21)
    confidence[4] = bad
    with refused(FormatError, "protocol.confidence"):
        wire.joint_arrays(wire.skeleton_frame(1, 2, np.zeros((21, 3)), confidence), "canonical")


def landmarks(**changes):
    """A frame of 33 landmarks, with other arrays where `changes` has them."""
    rng = np.random.default_rng(1)
    given = {
        "pixels": rng.uniform(0, 720, (33, 2)), "world_m": rng.normal(size=(33, 3)),
        "left_hand": rng.uniform(0, 720, (21, 2)), **changes,
    }  # fmt: skip
    return wire.landmark_frame(4, 5, wire.LandmarkArrays(720, 1280, **given), np.ones(33))


def test_landmarks_arrive_as_they_were_sent():
    frame = wire.decode(wire.encode(landmarks()))
    assert isinstance(frame, wire.SkeletonFrame)
    found, sent = wire.landmark_arrays(frame, "mediapipe"), np.random.default_rng(1).uniform(0, 720, (33, 2))
    assert found is not None and found.pixels == pytest.approx(sent, abs=1e-4)
    assert np.isfinite(found.world_m).all() and found.left_hand is not None and found.right_hand is None
    positions, visible = wire.joint_arrays(frame, "mediapipe")
    assert np.isnan(positions).all() and (visible == 1).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -4000.0, 1e30])
def test_a_landmark_that_is_nowhere_near_its_picture_is_unseen(bad):
    pixels = np.full((33, 2), 300.0)
    pixels[7, 1] = bad
    world_m = np.full((33, 3), 0.5)
    world_m[8, 2] = bad
    found = wire.landmark_arrays(landmarks(pixels=pixels, world_m=world_m), "mediapipe")
    assert found is not None and np.flatnonzero(np.isnan(found.pixels).any(axis=1)).tolist() == [7]
    assert np.flatnonzero(np.isnan(found.world_m).any(axis=1)).tolist() == [8]


@pytest.mark.parametrize(
    "change", [{"pixels": np.ones((32, 2))}, {"world_m": np.ones((33, 2))}, {"left_hand": np.ones((20, 2))}]
)
def test_another_number_of_landmarks_is_refused(change):
    with refused(FormatError, "protocol.landmarks_size"):
        wire.landmark_arrays(landmarks(**change), "mediapipe")


def test_several_bodies_are_frames_of_their_own():
    sent = [wire.skeleton_frame(4, 5, np.full((21, 3), k), np.full(21, 0.1 * k), body=k) for k in (7, 3, 3)]
    frame = wire.decode(wire.encode(wire.with_others(sent[0], sent[1:])))
    assert isinstance(frame, wire.SkeletonFrame)
    found = wire.each_body(frame)
    assert found == sent[:2]  # of two bodies with one number, the first
    alone = wire.decode(wire.encode(sent[0]))
    assert isinstance(alone, wire.SkeletonFrame) and wire.each_body(alone) == [alone]


def test_too_many_bodies_are_refused():
    one = wire.skeleton_frame(4, 5, np.zeros((21, 3)), np.ones(21))
    with refused(FormatError, "protocol.not_a_message"):
        wire.decode(wire.encode(wire.with_others(one, [one] * (wire.MOST_OTHERS + 1))))


def test_hello_is_checked():
    for version in (2, 3):
        wire.check_hello(msgspec.structs.replace(HELLO, protocol_version=version))
    wire.check_hello(HELLO)
    with refused(FormatError, "protocol.version"):
        wire.check_hello(msgspec.structs.replace(HELLO, protocol_version=4))
    with refused(FormatError, "joints.unknown_set", name="kinect"):
        wire.check_hello(msgspec.structs.replace(HELLO, joint_set="kinect"))


@pytest.mark.parametrize(
    ("name", "allowed"),
    [("camera_0", True), ("A.b-c", True), ("0", True), ("a" * 63, True), ("a" * 64, False), ("", False),
     (".hidden", False), ("../etc", False), ("a/b", False), ("a b", False), ("é", False), ("a\n", False),
     ("-x", False), ("a\x00", False)],
)  # fmt: skip
def test_camera_names(name, allowed):
    assert wire.is_camera_name(name) == allowed
    data = wire.encode(msgspec.structs.replace(HELLO, name=name))
    assert (decoded_or_refused(data) is not None) == allowed


@pytest.mark.parametrize(
    "change",
    [
        {"type": "nonsense"},
        {"type": 5},
        {"extra": 1},
        {"sequence": -1},
        {"sequence": 1.5},
        {"device_time_ns": -5},
        {"device_time_ns": 2**63},
        {"positions": "text"},
        {"positions": [1.0]},
        {"hands": [{"side": "left", "method": "shape", "open_probability": 2.0}]},
        {"hands": "both"},
        {"head_wxyz": [1.0, 0.0, 0.0]},
        {"confidence": None},
    ],
    ids=str,
)
def test_a_field_that_its_schema_does_not_allow_is_refused(change):
    value = msgspec.msgpack.decode(wire.encode(FRAME)) | change
    with refused(FormatError, "protocol.not_a_message"):
        wire.decode(msgspec.msgpack.encode(value))


def test_a_missing_field_is_refused():
    value = msgspec.msgpack.decode(wire.encode(FRAME))
    for key in ("type", "sequence", "device_time_ns", "positions", "confidence"):
        rest = {k: v for k, v in value.items() if k != key}
        assert decoded_or_refused(msgspec.msgpack.encode(rest)) is None


def test_a_message_that_is_too_long_is_refused_unread():
    with refused(FormatError, "protocol.message_size"):
        wire.decode(bytes(wire.MAX_MESSAGE_BYTES + 1))


def test_deep_nesting_is_refused():
    for prefix in (b"\x91", b"\x81\xa4type", b"\x81\x91"):
        assert decoded_or_refused(prefix * 200_000) is None


@quickly
@given(st.binary(max_size=400))
def test_random_bytes_are_refused_or_a_message(data):
    decoded_or_refused(data)


@quickly
@given(
    st.sampled_from(MESSAGES),
    st.lists(st.tuples(st.integers(0, 2000), st.integers(0, 255)), max_size=6),
    st.data(),
)
def test_spoiled_messages_are_refused_or_a_message(message, changes, data):
    spoiled = bytearray(wire.encode(message))
    for at, value in changes:
        spoiled[at % len(spoiled)] = value
    end = data.draw(st.integers(0, len(spoiled)))
    decoded_or_refused(bytes(spoiled[:end]))
    decoded_or_refused(bytes(spoiled) + bytes(spoiled[:end]))


values = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=8,
)


@quickly
@given(st.sampled_from(MESSAGES), st.data())
def test_fields_of_any_kind_are_refused_or_a_message(message, data):
    value = msgspec.msgpack.decode(wire.encode(message))
    key = data.draw(st.sampled_from(sorted(value)))
    decoded_or_refused(msgspec.msgpack.encode(value | {key: data.draw(values)}))


def test_depth_image_survives_the_wire():
    depth = np.random.default_rng(1).integers(0, 9000, (6, 8)).astype(np.uint16)
    message = wire.decode(wire.encode(wire.depth_image(3, 4, depth)))
    intrinsics = wire.Intrinsics(100.0, 100.0, 4.0, 3.0, 8, 6)
    assert np.array_equal(wire.depth_array(message, intrinsics), depth)
    with refused(FormatError, "protocol.image_size", size=98):
        wire.depth_array(message, wire.Intrinsics(100.0, 100.0, 4.0, 3.0, 7, 7))
    with refused(FormatError, "protocol.not_unpacked"):
        wire.depth_array(wire.DepthImage(3, 4, b"nothing"), intrinsics)
