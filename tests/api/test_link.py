"""The camera link: who is let in, who is refused and told why, and that others are undisturbed."""

import pytest
from websockets.exceptions import ConnectionClosed

from studio import wire
from tests.api.camera import Camera, send_frames, wait_until
from tests.live.performer import hello
from tests.patient import connect


@pytest.fixture
def studio(start_studio, tmp_path):
    return start_studio(tmp_path / "sessions")


def refusal(camera: Camera) -> wire.Refused:
    """The server's refusal; the link is closed after it."""
    message = camera.receive_kind(wire.Refused)
    with pytest.raises(ConnectionClosed):
        camera.socket.recv(timeout=60)
    return message


def test_hello_is_welcomed_and_the_first_camera_is_the_reference(studio):
    with Camera(studio.url("link"), 0) as first, Camera(studio.url("link"), 1) as second:
        assert first.greet() == wire.Welcome("camera_0", reference=True)
        assert second.greet() == wire.Welcome("camera_1", reference=False)
        cameras = studio.http.get("/status").json()["cameras"]
        assert list(cameras) == ["camera_0", "camera_1"]
        assert cameras["camera_0"]["state"] == "silent" and cameras["camera_0"]["reason"]


def test_another_protocol_version_is_refused(studio):
    with Camera(studio.url("link"), 0) as camera:
        answer = camera.greet(protocol_version=99)
        assert isinstance(answer, wire.Refused)
        assert "99" in answer.reason and f"version {wire.PROTOCOL_VERSION}" in answer.reason


def test_an_unknown_joint_set_is_refused(studio):
    with Camera(studio.url("link"), 0) as camera:
        answer = camera.greet(joint_set="octopus")
        assert isinstance(answer, wire.Refused) and "azure-kinect" in answer.reason


def test_a_second_camera_of_a_living_name_is_refused_and_the_first_goes_on(studio):
    with Camera(studio.url("link"), 0) as first, Camera(studio.url("link"), 0) as second:
        first.greet()
        answer = second.greet(boot_id="another")
        assert isinstance(answer, wire.Refused) and answer.code == "name_taken"
        send_frames([first], 3)
        wait_until(lambda: studio.stage.status().cameras["camera_0"].frames == 3, "3 frames came")


def test_a_name_is_free_again_when_its_client_has_left(studio):
    with Camera(studio.url("link"), 0) as first:
        first.greet()
    wait_until(lambda: studio.stage.status().cameras["camera_0"].state == "gone", "it is gone")
    with Camera(studio.url("link"), 0) as again:
        assert isinstance(again.greet(boot_id="boot-2"), wire.Welcome)


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\xff" * 100, b"\x81\xa4type\xa5hello", bytes(range(256))])
def test_garbage_instead_of_hello_is_refused(studio, data):
    with Camera(studio.url("link"), 0) as camera:
        camera.socket.send(data)
        assert refusal(camera).code == "format"
    assert studio.http.get("/status").json()["refused_links"]["count"] == 1


def test_text_is_refused(studio):
    with Camera(studio.url("link"), 0) as camera:
        camera.socket.send("hello")
        assert "binary" in refusal(camera).reason


def test_a_message_out_of_turn_is_refused(studio):
    with Camera(studio.url("link"), 0) as camera:
        camera.send(wire.ClockRequest(1))
        assert "first message must be hello" in refusal(camera).reason


def test_silence_instead_of_hello_is_refused(start_studio, tmp_path):
    studio = start_studio(tmp_path / "sessions", hello_timeout_s=0.2)
    with Camera(studio.url("link"), 0) as camera:
        assert refusal(camera).code == "hello_timeout"


@pytest.mark.parametrize(
    "message",
    [
        wire.SkeletonFrame(1, 1, b"\0" * 12, b"\0" * 4),
        wire.SkeletonFrame(1, 1, b"\0" * 252, b"\xff" * 84),
        wire.Welcome("camera_0", True),
    ],
    ids=["too few joints", "confidence is no number", "a message of the server"],
)
def test_a_camera_that_sends_garbage_is_closed_and_the_others_go_on(studio, message):
    with Camera(studio.url("link"), 0) as good, Camera(studio.url("link"), 1) as bad:
        good.greet()
        bad.greet()
        bad.send(message)
        told = refusal(bad)
        wait_until(lambda: studio.stage.status().cameras["camera_1"].state == "gone", "it is gone")
        status = studio.http.get("/status").json()["cameras"]["camera_1"]
        assert status["reason"] == told.reason and status["errors"] == 1
        send_frames([good], 5)
        wait_until(lambda: studio.stage.status().cameras["camera_0"].frames == 5, "5 frames came")


def test_a_message_that_is_too_large_closes_the_link(studio):
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        with pytest.raises(ConnectionClosed):  # while it is sent, or afterwards
            camera.socket.send(b"\0" * (wire.MAX_MESSAGE_BYTES + 1))
            while True:
                camera.socket.recv(timeout=60)
    wait_until(lambda: studio.stage.status().cameras["camera_0"].errors == 1, "the error is counted")


def test_the_clock_of_a_camera_is_found_by_exchange(studio):
    with Camera(studio.url("link"), 0) as first, Camera(studio.url("link"), 1) as second:
        first.greet()
        second.greet()
        for camera in (first, second):
            for _ in range(5):
                camera.exchange_clocks()
        wait_until(
            lambda: studio.stage.status().cameras["camera_1"].clock.source == "exchange",
            "it is known",
        )
        clock = studio.http.get("/status").json()["cameras"]["camera_1"]["clock"]
        assert abs(clock["offset_ms"] + 1000.0) < 50.0


def test_a_frame_from_the_far_future_is_not_used(studio):
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        camera.exchange_clocks()
        message = wire.SkeletonFrame(1, 2**61, b"\0" * 252, b"\0" * 84)
        camera.send(message)
        wait_until(lambda: studio.stage.status().cameras["camera_0"].skipped == 1, "it is counted")
        assert "check its clock" in studio.http.get("/status").json()["cameras"]["camera_0"]["reason"]


def test_a_page_of_another_site_may_not_open_the_link(studio):
    with pytest.raises(Exception, match="403"):
        connect(studio.url("link"), origin="http://elsewhere.example")


def test_the_same_start_of_a_client_takes_over_from_its_lost_link(studio):
    with Camera(studio.url("link"), 0) as lost, Camera(studio.url("link"), 0) as again:
        lost.greet()
        assert isinstance(again.greet(), wire.Welcome)
        lost.send_frame()
        assert refusal(lost).code == "replaced"
        again.send_frame()
        wait_until(lambda: studio.stage.status().cameras["camera_0"].frames == 1, "its frame came")


def test_the_operator_chooses_the_reference(studio):
    with Camera(studio.url("link"), 0) as first, Camera(studio.url("link"), 1) as second:
        first.greet()
        second.greet()
        answer = studio.http.put("/cameras/camera_1/reference")
        assert answer.status_code == 200 and answer.json()["camera_1"]["reference"]
        assert studio.http.put("/cameras/nobody/reference").status_code == 422
        studio.http.post("/record/start", json={"session": "s", "take": "t"}).raise_for_status()
        assert studio.http.put("/cameras/camera_0/reference").status_code == 409


def test_what_a_camera_is_limited_by_is_told(studio):
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        wait_until(
            lambda: studio.stage.status().cameras["camera_0"].limited_by == "no_frames", "no frame yet"
        )
        camera.exchange_clocks()
        nobody = wire.SkeletonFrame(1, camera.clock_ns(), b"\0\0\xc0\x7f" * 63, b"\0" * 84)
        camera.send(nobody)
        wait_until(lambda: studio.stage.status().cameras["camera_0"].limited_by == "no_performer", "nobody")
        camera.sequence = 1
        send_frames([camera], 5)
        wait_until(lambda: studio.stage.status().cameras["camera_0"].limited_by == "", "it sees someone")
        camera.sequence += 20
        send_frames([camera], 5)
        wait_until(
            lambda: studio.stage.status().cameras["camera_0"].limited_by == "network", "frames are lost"
        )


def test_kept_frames_of_an_unknown_take_stay_with_the_client(studio):
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        camera.send(wire.Kept("nowhere", "boot-1", 5, 9))
        answer = camera.receive_kind(wire.Ack)
        assert not answer.known and answer.up_to == 4


def test_frames_of_another_camera_are_not_taken(studio):
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        camera.send(wire.Kept("t", "old", 5, 9, hello("camera_7", boot_id="old")))
        assert "own name" in refusal(camera).reason


def test_a_spool_of_many_earlier_starts_is_known_to_its_first(studio):
    with Camera(studio.url("link"), 0) as camera:
        camera.greet()
        for start in range(40):
            old = f"boot-old-{start}"
            camera.send(wire.Kept("nowhere", old, 5, 9, hello("camera_0", boot_id=old)))
            assert not camera.receive_kind(wire.Ack).known
        camera.send(wire.Kept("nowhere", "boot-old-0", 5, 9))
        assert camera.receive_kind(wire.Ack).boot_id == "boot-old-0"
