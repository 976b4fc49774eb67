"""Timecode that comes in over real sockets, pipes and files, while this test plays the other machine."""

import os
import socket
import struct
import threading
import time
import wave
from contextlib import suppress

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.timecode.timecode import RATES, Timecode
from studio.timecode.incoming import IncomingTimecode
from studio.timecode.sound import LtcSource, ltc_of_file
from tests.api.camera import wait_until
from tests.engine.timecode.ltc_sound import sound
from tests.engine.timecode.test_packets import quarters

NS = 1_000_000_000


@pytest.fixture
def incoming():
    one = IncomingTimecode(time.monotonic_ns)
    yield one
    one.close()


class Sender:
    """Calls `send(frame)` at each frame's time, from a thread, until closed; leaves out frames whose time is over."""

    def __init__(self, rate, first, every, send):
        self.began_ns = time.monotonic_ns()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(rate, first, every, send))
        self._thread.start()

    def _run(self, rate, first, every, send):
        number = 0
        while not self._stopping.is_set():
            due_ns = self.began_ns + round(number * NS / rate.fps)
            time.sleep(max(0.0, (due_ns - time.monotonic_ns()) * 1e-9))
            send(first + number)
            over = int((time.monotonic_ns() - self.began_ns) * 1e-9 * rate.fps) - number
            number += every * max(1, over // every)

    def close(self):
        self._stopping.set()
        self._thread.join()


def check(incoming, sender, rate, first):
    """Compare with the sender's own clock: to half a second, as a busy machine delays both."""
    wait_until(lambda: incoming.status().state == "running", "timecode runs")
    time.sleep(0.5)
    now_ns = time.monotonic_ns()
    true = first + (now_ns - sender.began_ns) * 1e-9 * rate.fps
    assert abs(incoming.at(now_ns).frame - true) <= 0.5 * rate.count


def test_the_clock(incoming):
    incoming.choose("clock", "25")
    wait_until(lambda: incoming.status().state == "running", "timecode runs")
    h, m, s, _ = incoming.at(time.monotonic_ns()).parts
    now = time.localtime()
    apart = (h - now.tm_hour) * 3600 + (m - now.tm_min) * 60 + s - now.tm_sec
    assert abs((apart + 43_200) % 86_400 - 43_200) <= 1


def test_art_net_over_a_socket(incoming):
    rate = RATES["29.97df"]
    first = Timecode.parse("00:09:59;20", rate).frame
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    incoming.choose(f"artnet:127.0.0.1:{port}", "29.97df")
    channel = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def send(frame):
        h, m, s, f = Timecode(frame, rate).parts
        head = b"Art-Net\x00" + bytes([0x00, 0x97, 0x00, 0x0E, 0x00, 0x00])
        channel.sendto(head + bytes([f, s, m, h, 2]), ("127.0.0.1", port))

    sender = Sender(rate, first, 1, send)
    try:
        check(incoming, sender, rate, first)
        incoming.choose(f"artnet:127.0.0.1:{port}", "25")
        wait_until(lambda: incoming.status().problem, "the other rate is told")
        assert "of another rate than 25 came" in incoming.status().problem
        assert incoming.status().state == "waiting"
        incoming.choose(f"artnet:127.0.0.1:{port}", "29.97df")
        for number in range(500):  # what is no timecode changes nothing
            channel.sendto(os.urandom(number % 40), ("127.0.0.1", port))
        check(incoming, sender, rate, first)
    finally:
        sender.close()
        channel.close()
    time.sleep(1.2)
    assert incoming.status().state == "bridged"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_midi_bytes_of_a_device(incoming, tmp_path):
    rate = RATES["25"]
    first = Timecode.parse("10:00:00:00", rate).frame
    pipe = tmp_path / "midi"
    os.mkfifo(pipe)
    incoming.choose(f"mtc:{pipe}", "25")
    device = open(pipe, "wb", buffering=0)

    def send(frame):
        for data in quarters(Timecode(frame, rate), 1):
            device.write(data)

    sender = Sender(rate, first, 2, send)  # all eight at once: late by up to two frames
    try:
        check(incoming, sender, rate, first)
    finally:
        sender.close()
        device.close()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_ltc_from_a_pipe_in_real_time(incoming, tmp_path):
    rate, hz = RATES["24"], 48_000
    first = Timecode.parse("01:00:00:00", rate).frame
    samples, _ = sound(np.arange(first, first + 24 * 60), rate, hz, noise_db=-30.0)
    data = (samples * 32767).astype("<i2").tobytes()
    pipe = tmp_path / "sound.wav"
    os.mkfifo(pipe)
    incoming.choose(f"ltc:{pipe}", "24")
    device = open(pipe, "wb", buffering=0)
    device.write(
        b"RIFF" + struct.pack("<I", 2**31 - 1) + b"WAVEfmt " + struct.pack("<IHHIIHH", 16, 1, 1, hz, 2 * hz, 2, 16)
        + b"data" + struct.pack("<I", 2**31 - 40)
    )  # fmt: skip
    piece = 2 * hz // 24  # a frame

    sender = Sender(rate, 0, 1, lambda number: device.write(data[number * piece : (number + 1) * piece]))
    try:
        check(incoming, sender, rate, first)
    finally:
        sender.close()
        device.close()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
@pytest.mark.parametrize("writes", [False, True])
def test_who_no_longer_listens_to_a_pipe_takes_nothing_of_it(tmp_path, writes):
    pipe = tmp_path / "sound.wav"
    os.mkfifo(pipe)
    stopping = threading.Event()
    source = LtcSource(str(pipe), RATES["25"])

    def listen():
        with suppress(OSError, ValueError):  # it is stopped before it knows that this is sound
            source.run(time.monotonic_ns, lambda *_: None, stopping)

    listening = threading.Thread(target=listen)
    listening.start()
    device = open(pipe, "wb", buffering=0) if writes else None
    stopping.set()
    listening.join(60.0)
    assert not listening.is_alive()
    if device is not None:
        with pytest.raises(BrokenPipeError):  # nobody reads it
            device.write(b"RIFF")
        device.close()


def wav(path, channels, hz=48_000):
    with wave.open(str(path), "wb") as file:
        file.setnchannels(len(channels))
        file.setsampwidth(2)
        file.setframerate(hz)
        file.writeframes((np.stack(channels, axis=1) * 32767).astype("<i2").tobytes())
    return path


def test_a_file_with_ltc_beside_the_voice(tmp_path):
    rate = RATES["23.976"]
    first = Timecode.parse("00:59:58:00", rate).frame
    samples, begins = sound(np.arange(first, first + 240), rate, noise_db=-30.0, drop_outs_s=((4.0, 4.5),))
    voice = np.random.default_rng(1).normal(0, 0.1, len(samples)).astype(np.float32)
    path = ltc_of_file(wav(tmp_path / "recorder.wav", [voice, samples]), rate)
    assert path.source == "ltc" and len(path.gaps_s()) == 1
    said = [one.frame - first for one in path.timecodes_at(begins + 0.3 / rate.fps)]
    assert np.abs(np.array(said) - np.arange(240)).max() <= 1


def test_a_file_of_another_rate_or_none(tmp_path):
    rate = RATES["29.97df"]
    samples, _ = sound(np.arange(1000, 1100), rate)
    path = wav(tmp_path / "a.wav", [samples])
    with pytest.raises(FormatError, match="has no LTC at 25"):
        ltc_of_file(path, RATES["25"])
    (tmp_path / "b.wav").write_bytes(b"no sound")
    with pytest.raises(FormatError, match="cannot be read as sound"):
        ltc_of_file(tmp_path / "b.wav", rate)


@pytest.mark.parametrize("source", ["", "ltc", "ltc:", "mtc", "clock:25", "artnet:127.0.0.1:0", "vitc:1"])
def test_what_is_no_source(incoming, source):
    incoming.choose("clock", "25")
    with pytest.raises(SettingsError, match="allowed: off, clock, ltc:"):
        incoming.choose(source, "25")
    with pytest.raises(SettingsError, match=r"allowed: 23\.976, 24"):
        incoming.choose("clock", "26")
    assert incoming.chosen == "clock"


def test_a_device_that_is_not_there_is_told_and_waited_for(incoming, tmp_path):
    incoming.choose(f"mtc:{tmp_path / 'none'}", "25")
    wait_until(lambda: incoming.status().problem, "timecode runs")
    assert "none" in incoming.status().problem and incoming.status().state == "waiting"
    incoming.choose("off", "25")
    assert incoming.status().state == "off" and not incoming.status().problem
