"""Triggers through the server: packets over real sockets start and stop real takes, and others hear of them."""

import contextlib
import json
import socket
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest
from pythonosc.osc_message import OscMessage
from pythonosc.udp_client import SimpleUDPClient
from websockets.exceptions import ConnectionClosed

from studio.take.folder.take import Take
from studio.take.raw.frames import RawFrame, read_raw
from studio.triggers.capture_xml import parse_capture
from tests.api.camera import send_frames, wait_until
from tests.api.test_recording import cameras, studio  # noqa: F401
from tests.triggers.test_packets import OPTITRACK_START, VICON_START, VICON_STOP, hostile, osc


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def triggers(studio):  # noqa: F811
    """The server with XML and OSC switched on; (its XML port, its OSC port)."""
    ports = free_port(), free_port()
    answer = studio.http.patch(
        "/triggers", json={"xml": True, "osc": True, "xml_port": ports[0], "osc_port": ports[1]}
    )
    assert answer.status_code == 200, answer.text
    yield ports
    studio.http.patch("/triggers", json={"xml": False, "osc": False, "xml_out": False, "webhooks": False})


@contextlib.contextmanager
def sending(cameras):  # noqa: F811
    """The cameras send frames, and read what the server tells them, meanwhile."""
    stopping = threading.Event()

    def read(camera):
        with contextlib.suppress(TimeoutError, ConnectionClosed):
            while True:
                camera.socket.recv()

    for camera in cameras:
        threading.Thread(target=read, args=(camera,), daemon=True).start()

    def run():
        while not stopping.is_set():
            send_frames(cameras, 1)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        stopping.set()
        thread.join()


def udp(data, port):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.sendto(data, ("127.0.0.1", port))


def recording(studio):  # noqa: F811
    status = studio.http.get("/status").json()["recording"]
    return f"{status['session']}/{status['take']}" if status["active"] else None


def test_all_are_off_until_they_are_switched_on(studio):  # noqa: F811
    found = studio.http.get("/triggers").json()
    assert not any(found["settings"][name] for name in ("xml", "osc", "midi", "xml_out", "webhooks"))
    assert not any(one["on"] for one in found["status"].values() if isinstance(one, dict))
    assert found["settings"]["host"] == "127.0.0.1"


def test_a_take_by_the_packets_of_another_system(studio, cameras, triggers):  # noqa: F811
    with sending(cameras):
        for _ in range(3):
            udp(VICON_START, triggers[0])
        wait_until(lambda: recording(studio), "it records")
        assert recording(studio).endswith("/dance")
        udp(OPTITRACK_START, triggers[0])  # another one's: the take goes on
        time.sleep(0.3)
        for _ in range(3):
            udp(VICON_STOP, triggers[0])
        wait_until(lambda: recording(studio) is None, "it has ended")
        udp(OPTITRACK_START, triggers[0])
        wait_until(lambda: recording(studio) == "Monday/RemoteTriggerTest_take01", "it records")
        heard = lambda: studio.http.get("/triggers").json()["status"]["xml"]  # noqa: E731
        wait_until(lambda: (heard()["heard"], heard()["refused"]) == (3, 5), "all packets are counted")
        assert "RemoteTriggerTest" in heard()["last"]
    studio.http.post("/record/stop")
    (take,) = (Take.open(path.parent) for path in studio.sessions.glob("*/dance*/take.json"))
    assert take.meta["notes"].startswith("The pets ants") and take.meta["recording"] == "done"
    assert sum(isinstance(one, RawFrame) for one in read_raw(take.raw_path)) > 5


def test_osc_with_a_client_not_written_here(studio, cameras, triggers):  # noqa: F811
    client = SimpleUDPClient("127.0.0.1", triggers[1])

    def ask(address, *arguments):
        client.send_message(address, list(arguments))
        return next(iter(client.get_messages(60))).params

    with sending(cameras):
        assert ask("/record/start", "walk", "monday") == ["recording", "monday/walk", "", ""]
        assert ask("/record/state")[:2] == ["recording", "monday/walk"]
        assert ask("/record/start", "walk", "monday")[3]
        assert ask("/record/stop")[:2] == ["idle", ""]
        assert ask("/record/stop")[3] == "nothing is being recorded"
    client._sock.close()  # such a connection cannot be closed
    assert (studio.sessions / "monday" / "walk" / "take.json").exists()


def test_a_token_keeps_others_out(studio, triggers):  # noqa: F811
    settings = studio.http.patch("/triggers", json={"token": "long-enough"}).json()["settings"]
    assert settings["token"] == "********"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.settimeout(60.0)
        for arguments, words in (
            (("walk", "no"), "the token is missing or wrong"),
            (("walk", "long-enough"), ""),
        ):
            channel.sendto(osc("/record/start", *arguments).dgram, ("127.0.0.1", triggers[1]))
            assert OscMessage(channel.recv(4096)).params[3] == words
    assert recording(studio).endswith("/walk")
    studio.http.post("/record/stop")


def test_others_hear_of_takes(studio, cameras, triggers):  # noqa: F811
    posted = []

    class Receiver(BaseHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers["Content-Length"]))
            posted.append((self.headers.get("Authorization"), json.loads(body)))
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Receiver)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other, sending(cameras):
        other.bind(("127.0.0.1", 0))
        other.settimeout(60.0)
        answer = studio.http.patch("/triggers", json={
            "xml_out": True, "xml_targets": [f"127.0.0.1:{other.getsockname()[1]}"], "webhooks": True,
            "webhook_urls": [f"http://127.0.0.1:{server.server_port}/take"], "token": "long-enough",
        })  # fmt: skip
        assert answer.status_code == 200, answer.text
        studio.http.put("/timecode", json={"source": "clock", "rate": "25"})
        wait_until(lambda: studio.http.get("/status").json()["timecode"]["timecode"], "timecode runs")
        studio.http.post("/record/start", json={"session": "monday", "take": "walk"})
        start = parse_capture(other.recv(4096))
        wait_until(lambda: studio.stage.results.get()[0] > 5, "poses come")
        time.sleep(0.5)
        studio.http.post("/record/stop")
        stop = parse_capture(other.recv(4096))
        answer = studio.http.post("/takes/monday/walk/solves", json={"preset": "raw"})
        assert answer.status_code < 300, answer.text
        wait_until(lambda: len(posted) >= 3, "webhooks came")
    assert (start.kind, start.name, start.session, start.token) == ("start", "walk", "monday", "long-enough")
    assert len(start.timecode) == 11 and (stop.kind, stop.name) == ("stop", "walk")
    assert int(stop.packet) == int(start.packet) + 1
    assert posted[0][0] == "Bearer long-enough"
    assert [one["event"] for _, one in posted] == ["start", "stop", "solved"]
    assert (posted[2][1]["take"], posted[2][1]["solve"]) == ("walk", "raw")
    assert posted[1][1]["take"] == "walk" and posted[1][1]["seconds"] > 0
    server.shutdown()
    server.server_close()


def test_hostile_packets_and_then_a_take(studio, triggers):  # noqa: F811
    for number, data in enumerate(hostile(2, 1_000)):
        udp(data, triggers[number % 2])
    wait_until(lambda: studio.http.get("/status").status_code == 200, "it answers")
    if recording(studio):
        studio.http.post("/record/stop")

    def starts():
        udp(osc("/record/start", f"after {time.monotonic_ns()}").dgram, triggers[1])
        time.sleep(0.05)
        return recording(studio) is not None

    wait_until(starts, "it records")
    studio.http.post("/record/stop")


@pytest.mark.parametrize(
    "change",
    [{"xml_port": 0}, {"host": "http://a"}, {"webhooks": True}, {"webhook_urls": ["ftp://a"]}, {"midi": True},
     {"xml_targets": ["a"]}, {"token": "short"}, {"midi_note": 128}],
)  # fmt: skip
def test_what_is_not_allowed(studio, change):  # noqa: F811
    answer = studio.http.patch("/triggers", json=change)
    assert answer.status_code == 422 and "allowed" in answer.json()["error"]["message"]
    assert not studio.http.get("/triggers").json()["settings"]["midi"]


def latencies(studio, cameras, port, count):  # noqa: F811
    """Time from a packet to the arrival of the first frame that its take has [ms], for each of so many takes."""
    found = []
    for number in range(count):
        name = f"quick {number}"
        xml = f'<CaptureStart><Name VALUE="{name}"/><PacketID VALUE="{number + 1}"/></CaptureStart>'
        sent_ns = studio.stage.clock_ns()
        udp(xml.encode(), port)
        wait_until(lambda: recording(studio), "it records")
        time.sleep(0.15)
        udp(xml.replace("CaptureStart", "CaptureStop").encode(), port)
        wait_until(lambda: recording(studio) is None, "it has ended")
        (path,) = studio.sessions.glob(f"*/{name}/raw.mcap")
        firsts = [one.arrival_ns for one in read_raw(path) if isinstance(one, RawFrame)]
        assert firsts, f"{name} has frames"
        found.append((min(firsts) - sent_ns) * 1e-6)
    return np.array(found)


@pytest.mark.long
def test_from_packet_to_first_frame(studio, cameras, triggers):  # noqa: F811
    with sending(cameras):
        found = latencies(studio, cameras, triggers[0], 100)
    print("ms, 50 and 95 %:", np.percentile(found, [50, 95]).round(1))
    assert np.percentile(found, 95) < 50.0


@pytest.mark.long
@pytest.mark.timeout(2 * 3600)
@pytest.mark.parametrize(("count", "every_s"), [(120, 2.0), (180, 20.0)])
def test_a_soak(studio, cameras, triggers, count, every_s):  # noqa: F811
    """Four minutes, and an hour, of triggers, each packet sent twice: every take exists once, by its name."""
    names = [f"soak {number}" for number in range(count)]
    with sending(cameras):
        for number, name in enumerate(names):
            for kind, packet in (("CaptureStart", 2 * number + 1), ("CaptureStop", 2 * number + 2)):
                xml = f'<{kind}><Name VALUE="{name}"/><PacketID VALUE="{packet}"/></{kind}>'.encode()
                udp(xml, triggers[0])
                udp(xml, triggers[0])
                time.sleep(every_s / 2)
    wait_until(lambda: recording(studio) is None, "the last has ended")
    takes = [Take.open(path.parent) for path in studio.sessions.glob("*/*/take.json")]
    assert sorted(take.path.name for take in takes) == sorted(names)
    for take in takes:
        assert (
            take.meta["recording"] == "done"
            and sum(isinstance(r, RawFrame) for r in read_raw(take.raw_path)) > 10
        )
