"""Cameras are added from the page: simulated, recorded, or elsewhere; no name leads out of the allowed folders."""

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from studio.api.app import create_app
from studio.api.cameras.recordings import Recordings
from studio.api.errors import NotFoundError
from studio.engine.base.errors import SettingsError
from studio.live import LiveStage
from tests import patient
from tests.live.performer import calibration
from tests.web.playback.takes import take_with_solves
from tests.web.stages import serving


@pytest.fixture
def recordings(tmp_path: Path) -> Recordings:
    """A take with raw frames, a recording of two cameras two folders down, and things that are none."""
    sessions, folder = tmp_path / "sessions", tmp_path / "recordings"
    take_with_solves(sessions / "monday" / "one")
    for camera in ("camera_0", "camera_1"):
        place = folder / "june" / "walk" / camera
        place.mkdir(parents=True)
        (place / "joints.csv").write_text("time_s,hips_x,hips_y,hips_z,hips_confidence\n0,0,0,2,1\n")
    (folder / "notes.txt").write_text("nothing")
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret" / "camera_0").mkdir()
    (tmp_path / "secret" / "camera_0" / "joints.csv").write_text("time_s\n")
    (folder / "link").symlink_to(tmp_path / "secret")
    return Recordings(sessions, folder)


def test_videos_and_landmarks_are_found_with_their_cameras(tmp_path: Path) -> None:
    for name in ("left.mp4", "right side.mov"):
        (tmp_path / "shoot").mkdir(exist_ok=True)
        (tmp_path / "shoot" / name).touch()
    for name in ("a_json", "b_json"):
        (tmp_path / "points" / name).mkdir(parents=True)
        (tmp_path / "points" / name / "a_0_keypoints.json").write_text('{"people": []}')
    found = {one.id: one.sources() for one in Recordings(tmp_path / "sessions", tmp_path).list()}
    assert found == {
        "recordings/points": {name: f"recording:{tmp_path / 'points'}#{name}" for name in ("a", "b")},
        "recordings/shoot": {
            "left": f"video:{tmp_path / 'shoot' / 'left.mp4'}",
            "right_side": f"video:{tmp_path / 'shoot' / 'right side.mov'}",
        },
    }


def test_recordings_are_found_with_their_cameras(recordings: Recordings) -> None:
    found = {one.id: one.cameras for one in recordings.list()}
    assert found["recordings/june/walk"] == ("camera_0", "camera_1")
    assert "recordings/link" not in found and "recordings/notes.txt" not in found
    sources = recordings.find("recordings/june/walk").sources()
    assert sources["camera_1"].endswith("/june/walk#camera_1")


@pytest.mark.parametrize(
    "name",
    [
        "recordings/../secret", "recordings/link", "recordings/link/camera_0", "recordings//etc", "secret", "", "/",
        "recordings/", "recordings/june/../../secret", "takes/../recordings/june/walk", "recordings/june\0/walk",
        "recordings/nowhere", "takes/monday/../../secret",
    ],
)  # fmt: skip
def test_no_name_leads_out_of_the_folders(recordings: Recordings, name: str) -> None:
    with pytest.raises(NotFoundError):
        recordings.find(name)


def test_what_is_no_recording_is_refused(recordings: Recordings) -> None:
    with pytest.raises(SettingsError):
        recordings.find("recordings/notes.txt")


@pytest.fixture
def server(tmp_path: Path) -> Iterator[str]:
    stage = LiveStage(tmp_path / "sessions")
    stage.start()
    app = create_app(stage, tmp_path / "sessions", recordings=tmp_path / "recordings")
    with serving(app) as url:
        yield f"{url}/api/v1"
    app.state.local_cameras.close()
    stage.close()


def wait(condition: Callable[[], object], timeout_s: float = 60.0) -> None:
    end_s = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end_s, "it did not happen in time"
        time.sleep(0.1)


@pytest.mark.long
def test_simulated_cameras_are_started_and_stopped(server: str) -> None:
    def states() -> list[str]:
        return [one["state"] for one in patient.get(f"{server}/status").json()["cameras"].values()]

    answer = patient.post(f"{server}/local-cameras", json={"simulated": True})
    assert answer.status_code == 201 and answer.json()["opened"] == "simulated"
    wait(lambda: states() == ["live", "live"])
    assert patient.delete(f"{server}/local-cameras").json() == {
        "opened": None,
        "cameras": {},
        "performers": 1,
    }
    wait(lambda: states() == ["gone", "gone"])


def test_a_recording_plays_as_cameras(server: str, recordings: Recordings, tmp_path: Path) -> None:
    rows = "".join(f"{i / 30},0,0,2,1,0,0.4,2,1,0,0.6,2,1,0,0.7,2,1\n" for i in range(90))
    names = ",".join(
        f"{j}_{k}" for j in ("hips", "chest", "neck", "head") for k in ("x", "y", "z", "confidence")
    )
    for file in (tmp_path / "recordings" / "june" / "walk").glob("*/joints.csv"):
        file.write_text(f"time_s,{names}\n{rows}")
    listed = patient.get(f"{server}/recordings").json()
    walk = {"id": "recordings/june/walk", "cameras": ["camera_0", "camera_1"]}
    assert {**walk, "calibrated": False} in listed
    brought = tmp_path / "recordings" / "june" / "walk" / "calibration.json"
    brought.write_text(json.dumps(calibration(["camera_0", "camera_1"]).to_json()))
    assert {**walk, "calibrated": True} in patient.get(f"{server}/recordings").json()
    assert (
        patient.post(f"{server}/local-cameras", json={"recording": "recordings/june/walk"}).status_code == 201
    )
    assert patient.get(f"{server}/status").json()["calibration"]["borrowed"]

    def frames() -> list[int]:
        return [one["frames"] for one in patient.get(f"{server}/status").json()["cameras"].values()]

    wait(lambda: len(frames()) == 2 and min(frames()) > 5)
    refused = patient.post(f"{server}/local-cameras", json={"recording": "recordings/../secret"})
    assert refused.status_code == 404
    stopped = patient.delete(f"{server}/local-cameras").json()
    assert stopped == {"opened": None, "cameras": {}, "performers": 1}
    assert not patient.get(f"{server}/status").json()["calibration"]["borrowed"]


def test_an_invitation_tells_the_command(server: str) -> None:
    made = patient.post(f"{server}/cameras/invite", json={}).json()
    assert made["server"] == server.removesuffix("/api/v1") and made["token"] == "" and made["local"]
    assert made["url"] == f"{made['server']}/camera" and made["qr"]
