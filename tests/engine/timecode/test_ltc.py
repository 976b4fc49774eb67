"""LTC with the faults of a film set, in all rates, and against libltc, an independent implementation."""

import ctypes
import ctypes.util

import numpy as np
import pytest

from studio.engine.timecode.course import course
from studio.engine.timecode.ltc import LtcDecoder
from studio.engine.timecode.timecode import RATES, Timecode
from tests.engine.timecode.ltc_sound import sound

HZ = 48_000.0
SECONDS = 8


def decoded(samples, rate, sample_hz=HZ, piece=1024):
    decoder = LtcDecoder(rate, sample_hz)
    found = []
    for begin in range(0, len(samples), piece):
        found += decoder.feed(samples[begin : begin + piece])
    return [(sample / sample_hz, frame) for sample, frame in found]


def frames_from(text, rate, seconds=SECONDS):
    first = Timecode.parse(text, rate).frame
    return np.mod(first + np.arange(2 * round(seconds * rate.fps / 2)), rate.day)


@pytest.mark.parametrize("name", RATES)
def test_every_frame_is_right_to_one_frame(name):
    """Noise at -30 dB, wow of 0.2 %, drop-outs of 0.5 s, over midnight, and a jump back to another hour."""
    rate = RATES[name]
    frames = np.concatenate([frames_from("23:59:56:10", rate), frames_from("09:59:58:12", rate)])
    samples, begins = sound(
        frames, rate, HZ, noise_db=-30.0, wow=0.002, drop_outs_s=((2.0, 2.5), (5.1, 5.6), (11.0, 11.5))
    )
    found = course(decoded(samples, rate), rate, "ltc")
    middle = begins + 0.4 / rate.fps
    said = np.array([one.frame for one in found.timecodes_at(middle)])
    assert np.abs((said - frames + rate.day / 2) % rate.day - rate.day / 2).max() <= 1
    assert (said == frames).mean() > 0.99
    bridged = found.bridged_at(middle)
    out = np.zeros(len(middle), bool)
    for begin, end in ((2.0, 2.5), (5.1, 5.6), (11.0, 11.5)):
        out |= (middle > begin + 2.5 * rate.ltc_frames / rate.fps) & (middle < end)
    assert bridged[out].all() and bridged.mean() < 0.15
    assert len(found.runs) == 2 and len(found.jumps()) == 1
    at, _, after = found.jumps()[0]
    assert abs(at - begins[len(frames) // 2]) < 0.1 and after.frame - frames[len(frames) // 2] in (0, 1, 2)


@pytest.mark.parametrize("ppm", [-80.0, 0.0, 40.0])
def test_drift_is_measured(ppm):
    rate = RATES["25"]
    samples, _ = sound(frames_from("10:00:00:00", rate, 40), rate, HZ, noise_db=-30.0, ppm=ppm)
    assert course(decoded(samples, rate), rate).drift_ppm == pytest.approx(ppm, abs=2.0)


@pytest.mark.parametrize("sample_hz", [22_050.0, 44_100.0, 96_000.0])
def test_other_sample_rates_and_pieces(sample_hz):
    rate = RATES["29.97df"]
    frames = frames_from("00:00:59;00", rate, 3)
    samples, begins = sound(frames, rate, sample_hz)
    found = decoded(0.01 * samples, rate, sample_hz, piece=333)
    assert [frame for _, frame in found] == frames[: len(found)].tolist() and len(found) >= len(frames) - 1
    assert np.abs(np.array([time for time, _ in found]) - begins[: len(found)]).max() < 1e-4


def test_noise_and_voices_make_no_timecode():
    rng = np.random.default_rng(3)
    noise = rng.normal(0.0, 0.3, int(30 * HZ)).astype(np.float32)
    square = np.sign(np.sin(2 * np.pi * 1000 * np.arange(int(5 * HZ)) / HZ)).astype(np.float32)
    found = decoded(np.concatenate([noise, square, np.zeros(1000, np.float32)]), RATES["25"])
    assert not course(found, RATES["25"]).runs


def test_ten_thousand_hostile_pieces_of_sound_do_no_harm():
    """Noise, cut words, clipped and damaged samples; afterwards timecode is read as before."""
    rng, rate = np.random.default_rng(7), RATES["25"]
    good, _ = sound(frames_from("10:00:00:00", rate, 2), rate)
    decoder, found = LtcDecoder(rate, HZ), []
    for number in range(10_000):
        begin, count = int(rng.integers(0, len(good))), int(rng.integers(0, 300))
        piece = good[begin : begin + count].copy()
        if number % 3 == 0:
            piece = (10.0 ** rng.uniform(-3, 6) * rng.normal(size=count)).astype(np.float32)
        elif len(piece) and number % 3 == 1:
            piece[rng.integers(0, len(piece))] = rng.choice([np.nan, np.inf, -np.inf, 1e30, 0.0])
        found += decoder.feed(piece)
    assert len(found) < 10 and all(0 <= frame < rate.day for _, frame in found)
    assert len(decoder.feed(good)) > 40


def libltc():
    name = ctypes.util.find_library("ltc")
    if name is None:
        pytest.skip("libltc is not installed (Debian: apt install libltc11)")
    library = ctypes.CDLL(name)
    for function in ("ltc_encoder_create", "ltc_decoder_create"):
        getattr(library, function).restype = ctypes.c_void_p
    return library


class SmpteTime(ctypes.Structure):
    """`SMPTETimecode` of ltc.h."""

    _fields_ = [("timezone", ctypes.c_char * 6)] + [
        (name, ctypes.c_ubyte) for name in ("years", "months", "days", "hours", "mins", "secs", "frame")
    ]


@pytest.mark.parametrize("name", ["23.976", "24", "25", "29.97df", "29.97", "30"])
def test_what_libltc_writes_is_read(name):
    library, rate = libltc(), RATES[name]
    encoder = ctypes.c_void_p(
        library.ltc_encoder_create(
            ctypes.c_double(HZ), ctypes.c_double(rate.fps), 1 if rate.count == 25 else 0, 0
        )
    )
    start = Timecode.parse("00:00:58:00", rate)
    hours, minutes, seconds, frame = start.parts
    library.ltc_encoder_set_timecode(
        encoder, ctypes.byref(SmpteTime(b"+0000", 0, 0, 0, hours, minutes, seconds, frame))
    )
    first = (ctypes.c_ubyte * 10)()
    library.ltc_encoder_get_frame(encoder, first)
    first[1] = first[1] & ~0x04 | 0x04 * rate.drop  # it takes 29.97 for drop-frame
    library.ltc_encoder_set_frame(encoder, first)
    pieces, buffer = [], (ctypes.c_ubyte * 8192)()
    for _ in range(5 * rate.count):
        library.ltc_encoder_encode_frame(encoder)
        count = library.ltc_encoder_get_buffer(encoder, buffer)
        pieces.append(np.frombuffer(bytes(buffer[:count]), np.uint8))
        library.ltc_encoder_inc_timecode(encoder)
    library.ltc_encoder_free(encoder)
    samples = (np.concatenate(pieces).astype(np.float32) - 128.0) / 128.0
    found = [frame for _, frame in decoded(samples, rate)]
    assert len(found) >= 5 * rate.count - 2
    assert found == [start.frame + k + found[0] - start.frame for k in range(len(found))]
    assert found[0] - start.frame in (0, 1)


class LtcFrameExt(ctypes.Structure):
    """`LTCFrameExt` of ltc.h, as far as it is read."""

    _fields_ = [
        ("ltc", ctypes.c_ubyte * 10), ("off_start", ctypes.c_longlong), ("off_end", ctypes.c_longlong),
        ("reverse", ctypes.c_int), ("rest", ctypes.c_ubyte * 512),
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["24", "25", "29.97df", "50", "59.94df"])
def test_the_sound_of_these_tests_is_read_by_libltc_as_here(name):
    library, rate = libltc(), RATES[name]
    frames = frames_from("00:00:58:00", rate, 4)
    samples, _ = sound(frames, rate, HZ)
    mine = [frame for _, frame in decoded(samples, rate)]
    decoder = ctypes.c_void_p(library.ltc_decoder_create(int(HZ * rate.ltc_frames / rate.fps), 300))
    library.ltc_decoder_write_float(
        decoder,
        samples.ctypes.data_as(ctypes.POINTER(ctypes.c_float)),
        ctypes.c_size_t(len(samples)),
        ctypes.c_longlong(0),
    )
    theirs, one, smpte = [], LtcFrameExt(), SmpteTime()
    while library.ltc_decoder_read(decoder, ctypes.byref(one)):
        library.ltc_frame_to_time(ctypes.byref(smpte), one.ltc, 0)
        assert bool(one.ltc[1] & 4) == rate.drop
        theirs.append(rate.frame(smpte.hours, smpte.mins, smpte.secs, smpte.frame * rate.ltc_frames))
    library.ltc_decoder_free(decoder)
    assert len(theirs) > 0.8 * len(frames) / rate.ltc_frames
    assert set(theirs) <= set(mine)


def test_what_runs_backwards_is_told_and_not_read():
    rate = RATES["25"]
    samples, _ = sound(frames_from("10:00:00:00", rate, 3), rate, noise_db=-30.0)
    decoder = LtcDecoder(rate, HZ)
    assert decoder.feed(samples[::-1]) == [] and decoder.backwards
    assert len(decoder.feed(samples)) > 60 and not decoder.backwards
