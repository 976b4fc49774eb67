"""Packets of triggers: those that the makers' documentation shows, and 10,000 that are none."""

import numpy as np
import pytest
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder

from studio.triggers.capture_xml import capture_packet, parse_capture
from studio.triggers.midi_note import NoteDecoder
from studio.triggers.osc import parse_osc, state_message

VICON_START = (
    b'<?xml version="1.0" encoding="UTF-8" standalone="no"?><CaptureStart><Name VALUE="dance"/>'
    b'<Notes VALUE="The pets ants crime deer jump. "/><Description VALUE="The crowd"/>'
    b'<DatabasePath VALUE="D:/Captures/Take"/><Delay VALUE="33"/><PacketID VALUE="33360"/></CaptureStart>\0'
)
VICON_STOP = (
    b'<?xml version="1.0" encoding="UTF-8" standalone="no"?><CaptureStop RESULT="CANCEL"><Name VALUE="dance"/>'
    b'<DatabasePath VALUE="D:/Captures/Take"/><Delay VALUE="33"/><PacketID VALUE="33361"/></CaptureStop>\0'
)
OPTITRACK_START = (
    b'<?xml version="1.0" encoding="UTF-8"?>\n<CaptureStart>\n<Name VALUE="RemoteTriggerTest_take01"/>'
    b'\n<SessionName VALUE="Monday" />\n<Notes VALUE=""/><Assets VALUE="RigidBody1" /><Description VALUE="" />'
    b'<DatabasePath VALUE=""/><TimeCode VALUE="10:00:00:00"/><PacketID VALUE="0"/>\n</CaptureStart>'
)


def test_the_form_of_vicon():
    start, stop = parse_capture(VICON_START), parse_capture(VICON_STOP)
    assert (start.kind, start.name, start.packet) == ("start", "dance", "33360")
    assert start.notes == "The pets ants crime deer jump.\nThe crowd"
    assert (stop.kind, stop.name, stop.packet, stop.success) == ("stop", "dance", "33361", False)


def test_the_form_of_optitrack():
    start = parse_capture(OPTITRACK_START)
    assert (start.name, start.session, start.timecode) == (
        "RemoteTriggerTest_take01",
        "Monday",
        "10:00:00:00",
    )
    assert start.packet == ""  # 0: it does not count


def test_what_is_sent_is_read_and_signs_are_safe():
    name = 'a "b" <c> & \u00e9'
    packet = capture_packet(
        "start", name=name, session="s", timecode="01:00:00:00", packet=7, token="0123456789"
    )
    found = parse_capture(packet)
    assert (found.name, found.session, found.packet, found.token) == (name, "s", "7", "0123456789")
    assert packet.endswith(b"\0")
    assert parse_capture(capture_packet("stop", name=name, session="s", timecode="", packet=8)).success


@pytest.mark.parametrize(
    "data",
    [
        b"", b"\0", b"<CaptureStart>", b"<CaptureComplete/>", b"<a/>", b"\xff\xfe<CaptureStart/>",
        b'<!DOCTYPE a [<!ENTITY b "c">]><CaptureStart><Name VALUE="&b;"/></CaptureStart>',
        b"<CaptureStart>" + b"<a>" * 20_000, b"<CaptureStart " + b"a" * 70_000 + b"/>",
    ],
)  # fmt: skip
def test_what_is_no_capture_packet(data):
    assert parse_capture(data) is None


def osc(address, *arguments):
    builder = OscMessageBuilder(address)
    for argument in arguments:
        builder.add_arg(argument)
    return builder.build()


def test_osc():
    (start,) = parse_osc(osc("/record/start", "walk", "monday").dgram, with_token=False)
    assert (start.kind, start.name, start.session, start.token) == ("start", "walk", "monday", "")
    (start,) = parse_osc(osc("/record/start", "walk", "secret12").dgram, with_token=True)
    assert (start.name, start.session, start.token) == ("walk", "", "secret12")
    (start,) = parse_osc(osc("/record/start", 5, "monday").dgram, with_token=False)
    assert (start.name, start.session) == ("5", "monday")
    (stop,) = parse_osc(b"/record/stop\0\0\0\0", with_token=False)  # old senders say no kinds of arguments
    assert stop.kind == "stop"
    bundle = OscBundleBuilder(IMMEDIATELY)
    bundle.add_content(osc("/record/stop"))
    bundle.add_content(osc("/other", 1.0))
    assert [one.kind for one in parse_osc(bundle.build().dgram, with_token=False)] == ["stop"]
    answer = OscMessage(state_message(True, "monday/walk", "10:00:00:00", ""))
    assert (answer.address, answer.params) == (
        "/record/state",
        ["recording", "monday/walk", "10:00:00:00", ""],
    )


def test_a_midi_note():
    decoder = NoteDecoder(60)
    assert len(decoder.feed(bytes([0x90, 60, 100, 60, 0, 60, 90]))) == 2  # pressed, released, pressed again
    assert decoder.feed(bytes([0x90, 61, 100, 0x80, 60, 64, 0xB0, 60, 1])) == []
    assert len(decoder.feed(bytes([0x93, 60])) + decoder.feed(bytes([0xF8, 1]))) == 1


def hostile(seed, count):
    """Packets that are nearly right, cut, changed, doubled, or noise."""
    rng = np.random.default_rng(seed)
    good = [
        VICON_START,
        VICON_STOP,
        OPTITRACK_START,
        osc("/record/start", "walk").dgram,
        osc("/record/stop").dgram,
    ]
    for number in range(count):
        data = bytearray(good[number % len(good)])
        kind = number % 7
        if kind == 0:
            data = bytearray(rng.bytes(int(rng.integers(0, 300))))
        elif kind == 1:
            del data[int(rng.integers(0, len(data))) :]
        elif kind == 2:
            data *= int(rng.integers(2, 30))
        else:
            for _ in range(int(rng.integers(1, 12))):
                data[int(rng.integers(0, len(data)))] = int(rng.integers(0, 256))
        yield bytes(data)


def test_ten_thousand_hostile_packets_do_no_harm(caplog):
    notes = NoteDecoder(60)
    for data in hostile(1, 10_000):
        for found in (parse_capture(data), *(parse_osc(data, with_token=True) or ())):
            assert found is None or (len(found.name) <= 1000 and len(found.notes) <= 2001)
        notes.feed(data)
    assert len(notes._data) < 3
    assert not caplog.records  # no sender can fill the log
