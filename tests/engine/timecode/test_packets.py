"""MIDI timecode and Art-Net timecode, byte by byte as in their specifications."""

import numpy as np
import pytest

from studio.engine.timecode.artnet import frame_of_packet
from studio.engine.timecode.course import course
from studio.engine.timecode.mtc import MtcDecoder
from studio.engine.timecode.timecode import RATES, Timecode

MTC_KINDS = {"23.976": 0, "24": 0, "25": 1, "29.97df": 2, "29.97": 3, "30": 3, "47.952": 0, "48": 0, "50": 1,
             "59.94df": 2, "59.94": 3, "60": 3}  # fmt: skip


def quarters(timecode, kind):
    """The eight quarter frames of a frame."""
    h, m, s, f = timecode.parts
    h, f = h | kind << 5, f // timecode.rate.ltc_frames
    digits = [part >> shift & 15 for part in (f, s, m, h) for shift in (0, 4)]
    return [bytes([0xF1, number << 4 | digit]) for number, digit in enumerate(digits)]


@pytest.mark.parametrize("name", RATES)
def test_quarter_frames_tell_every_frame(name):
    rate, decoder, found = RATES[name], MtcDecoder(RATES[name]), []
    first = Timecode.parse("00:09:58:00", rate).frame
    step_ns = 1e9 * rate.ltc_frames / rate.fps / 4
    jitter_ns = np.random.default_rng(2).uniform(0, 2e6, 4 * 300)
    for pair in range(150):
        timecode = Timecode(first + 2 * rate.ltc_frames * pair, rate)
        for k, data in enumerate(quarters(timecode, MTC_KINDS[name])):
            number = 8 * pair + k
            clocked = data[:1] + b"\xf8" + data[1:]  # a clock may come between any two bytes
            found += decoder.feed(clocked, round(number * step_ns + jitter_ns[number]))
    assert len(found) == 150
    times = np.arange(300 * rate.ltc_frames - 2) / rate.fps
    path = course([(ns * 1e-9, frame) for ns, frame in found], rate)
    said = [one.frame - first for one in path.timecodes_at(times + 0.4 / rate.fps)]
    assert np.abs(np.array(said) - np.arange(len(times))).max() <= 1
    assert not path.bridged_at(times[1:]).any()


def test_a_full_frame_and_the_rate_of_the_device():
    # MIDI Time Code specification: F0 7F <device> 01 01 hr mn sc fr F7; hr = 0yyzzzzz, yy = 01: 25 frames a second
    message = bytes([0xF0, 0x7F, 0x7F, 0x01, 0x01, 0x21, 0x02, 0x03, 0x04, 0xF7])
    assert MtcDecoder(RATES["25"]).feed(message, 5) == [(5, RATES["25"].frame(1, 2, 3, 4))]
    assert MtcDecoder(RATES["50"]).feed(message, 5) == [(5, RATES["50"].frame(1, 2, 3, 8))]
    other = MtcDecoder(RATES["24"])
    assert other.feed(message, 5) == [] and other.refused == 1


def test_odd_bytes_do_no_harm():
    rng, decoder = np.random.default_rng(5), MtcDecoder(RATES["30"])
    for _ in range(10_000):
        decoder.feed(rng.integers(0, 256, rng.integers(0, 40), dtype=np.uint8).tobytes(), 0)
    decoder.feed(b"\xf0" + bytes(100_000), 0)
    assert len(decoder._message) <= 65 and len(decoder._quarters) <= 8


def test_a_packet_of_art_net():
    # ArtTimeCode: ID, OpTimeCode 0x9700, protocol 14, filler, stream, frames, seconds, minutes, hours, type
    head = b"Art-Net\x00" + bytes([0x00, 0x97, 0x00, 0x0E, 0x00, 0x00])
    packet = head + bytes([24, 59, 1, 10, 1])
    assert frame_of_packet(packet, RATES["25"]) == RATES["25"].frame(10, 1, 59, 24)
    assert frame_of_packet(packet, RATES["50"]) == RATES["50"].frame(10, 1, 59, 48)
    assert frame_of_packet(packet, RATES["30"]) is None
    assert frame_of_packet(head + bytes([2, 0, 1, 0, 2]), RATES["29.97df"]) == 1800
    assert (
        frame_of_packet(head + bytes([1, 0, 1, 0, 2]), RATES["29.97df"]) is None
    )  # a number that is left out


def test_ten_thousand_hostile_packets_of_art_net_are_a_number_of_the_rate_or_none():
    rng, rate = np.random.default_rng(6), RATES["29.97df"]
    good = b"Art-Net\x00" + bytes([0x00, 0x97, 0x00, 0x0E, 0x00, 0x00, 2, 0, 1, 0, 2])
    for number in range(10_000):
        data = bytearray(good if number % 4 else rng.bytes(int(rng.integers(0, 60))))
        for place in rng.integers(0, max(len(data), 1), number % 5) if data else ():
            data[place] = rng.integers(0, 256)
        cut = int(rng.integers(0, len(data) + 1)) if number % 3 == 0 else len(data)
        found = frame_of_packet(bytes(data[:cut]), rate)
        assert found is None or 0 <= found < rate.day


@pytest.mark.parametrize("cut", range(19))
def test_half_a_packet_is_none(cut):
    head = b"Art-Net\x00" + bytes([0x00, 0x97, 0x00, 0x0E, 0x00, 0x00])
    assert frame_of_packet((head + bytes([1, 1, 1, 1, 1]))[:cut], RATES["25"]) is None
