"""Files of a browser's machine become takes: real recordings, what goes wrong on the way, and nothing left behind."""

import shutil
import socket
import time
from collections import namedtuple
from pathlib import Path
from typing import Any

from studio.api.takes import imports as module
from studio.api.takes.changes import LOOK_S, Changes
from studio.take.folder.take import Take
from studio.take.importers import import_recording
from studio.take.library import incoming
from studio.take.library.incoming import PREFIX
from tests.api.camera import wait_until
from tests.api.test_routes import assert_error, codes


def files_of(path: Path) -> dict[str, bytes]:
    """The files below a path, by their path from its parent, as a browser names them."""
    files = [path] if path.is_file() else sorted(one for one in path.rglob("*") if one.is_file())
    return {one.relative_to(path.parent).as_posix(): one.read_bytes() for one in files}


def announced(studio, files: dict[str, bytes]) -> list[dict[str, Any]]:
    wanted = [{"path": path, "size": len(data)} for path, data in files.items()]
    answer = studio.http.post("/imports", json={"files": wanted})
    assert answer.status_code == 202, answer.text
    return answer.json()["imports"]


def imported(studio, files: dict[str, bytes]) -> list[dict[str, Any]]:
    """Send files as the page does; return the jobs once they have ended."""
    contents = list(files.values())
    jobs = []
    for one in announced(studio, files):
        if one["job"]["state"] == "waiting":
            studio.http.put(
                f"/imports/{one['job']['id']}", content=b"".join(contents[i] for i in one["files"])
            )
        jobs.append(ended(studio, one["job"]["id"]))
    return jobs


def ended(studio, job_id: str) -> dict[str, Any]:
    address = f"/jobs/{job_id}"
    wait_until(lambda: studio.http.get(address).json()["ended"], "the import ends")
    return studio.http.get(address).json()


def left(studio) -> list[str]:
    """What uploaded files have left in the sessions."""
    return [path.name for path in studio.sessions.rglob(f"*{PREFIX}*")] + [
        path.name for path in studio.sessions.rglob("*.partial-*")
    ]


def test_an_unknown_way_to_bring_videos_to_one_clock_is_refused(studio):
    answer = studio.http.post("/imports", json={"files": [{"path": "a.mp4", "size": 1}], "sync": "magic"})
    assert_error(answer, 422, "settings", "value.bad")


def test_a_clap_at_no_second_is_refused(studio):
    for clap in ("left=soon", "nan", "-1"):
        asked = {"files": [{"path": "a.mp4", "size": 1}], "clap_at": [clap]}
        assert_error(studio.http.post("/imports", json=asked), 422, "settings", "value.bad")


def test_a_recording_and_an_animation_at_once(studio, test_data, tmp_path):
    walk = test_data / "noisy_joints" / "punches_2_cameras"
    files = files_of(walk) | files_of(test_data / "mocap" / "02_01.bvh")
    before = studio.http.get("/takes").json()
    jobs = imported(studio, files)
    assert [job["state"] for job in jobs] == ["done", "done"], jobs
    assert {job["step"] for job in jobs} == {"read"} and before == []
    takes = {take["name"]: take for take in studio.http.get("/takes").json()}
    assert takes["punches_2_cameras"]["cameras"] == ["camera_0", "camera_1"]
    assert takes["02_01"]["solves"] == ["imported"]
    by_command = import_recording(walk, tmp_path / "same")
    same = Take.open(studio.sessions / takes["punches_2_cameras"]["id"])
    assert same.raw_path.read_bytes() == by_command.raw_path.read_bytes()
    again = imported(studio, files_of(test_data / "mocap" / "02_01.bvh"))
    assert again[0]["take"].endswith("/02_01_2")
    assert left(studio) == []


def test_a_take_as_one_file_and_as_a_folder(recorded):
    bundle = recorded.http.get("/takes/tests/one/file").content
    folder = files_of(recorded.sessions / "tests/one")
    jobs = imported(recorded, {"one.take.zip": bundle} | {n: d for n, d in folder.items() if "/." not in n})
    assert [job["state"] for job in jobs] == ["done", "done"], jobs
    assert [Take.open(recorded.sessions / job["take"]).solve_names() for job in jobs] == [["live"], ["live"]]
    assert left(recorded) == []


def test_the_importers_own_words_of_a_truncated_and_of_an_unknown_file(studio, test_data):
    files = files_of(test_data / "noisy_joints" / "punches_2_cameras")
    name = "punches_2_cameras/camera_1/joints.csv"
    files[name] = files[name][:100_003]
    mkv = next((test_data / "sensor_files").glob("*.mkv"))
    files |= {"notes.txt": b"hello", "cut.mkv": mkv.read_bytes()[:2000], "../../evil.bvh": b"HIERARCHY"}
    jobs = {job["name"]: job for job in imported(studio, files)}
    cut = jobs["punches_2_cameras"]
    assert (cut["state"], cut["take"]) == ("failed", "") or cut["state"] == "done"
    assert codes(jobs["notes.txt"]) == ["import.unknown_kind"]
    assert jobs["cut.mkv"]["state"] == "failed" and codes(jobs["cut.mkv"]) == ["import.not_matroska"]
    assert codes(jobs["../../evil.bvh"]) == ["import.name"]
    assert not any(str(studio.sessions) in job["message"] for job in jobs.values())
    assert left(studio) == [] and not list(studio.sessions.parent.rglob("evil*"))


def opened(studio, job_id: str, announced_bytes: int, sent: bytes) -> socket.socket:
    """A browser that has sent a part of what it announced."""
    link = socket.create_connection(("127.0.0.1", studio.port))
    head = f"PUT /api/v1/imports/{job_id} HTTP/1.1\r\nHost: x\r\nContent-Length: {announced_bytes}\r\n\r\n"
    link.sendall(head.encode() + sent)
    return link


def test_a_browser_that_goes_leaves_nothing(studio):
    (one,) = announced(studio, {"a.bvh": b"x" * 4_000_000})
    link = opened(studio, one["job"]["id"], 4_000_000, b"x" * 1_500_000)
    wait_until(lambda: left(studio), "it is written")
    link.close()
    job = ended(studio, one["job"]["id"])
    assert job["state"] == "failed" and codes(job) == ["import.browser_gone"]
    assert left(studio) == [] and studio.http.get("/takes").json() == []


def test_a_cancelled_upload_leaves_nothing(studio):
    first, second = announced(studio, {"a.bvh": b"x" * 4_000_000, "b.bvh": b"y"})
    with opened(studio, first["job"]["id"], 4_000_000, b"x" * 1_500_000):
        wait_until(lambda: left(studio), "it is written")
        for one in (first, second):
            studio.http.post(f"/jobs/{one['job']['id']}/cancel").raise_for_status()
        assert [ended(studio, one["job"]["id"])["state"] for one in (first, second)] == ["cancelled"] * 2
    assert left(studio) == []
    assert_error(studio.http.put(f"/imports/{second['job']['id']}", content=b"y"), 404, "not_found")


def test_a_browser_that_never_sends_is_given_up(studio, monkeypatch):
    monkeypatch.setattr(module, "SILENT_S", 0.2)
    (one,) = announced(studio, {"a.bvh": b"x"})
    assert ended(studio, one["job"]["id"])["state"] == "failed"
    assert left(studio) == []


def test_other_sizes_than_announced(studio):
    (less,) = announced(studio, {"a.bvh": b"x" * 10})
    assert_error(
        studio.http.put(f"/imports/{less['job']['id']}", content=b"x"), 422, "format", "import.broke_off"
    )
    (more,) = announced(studio, {"a.bvh": b"x" * 10})
    assert_error(
        studio.http.put(f"/imports/{more['job']['id']}", content=b"x" * 11),
        422,
        "format",
        "import.more_than_announced",
    )
    assert left(studio) == []


def test_a_disk_without_room(studio, monkeypatch):
    usage = namedtuple("usage", "total used free")
    full = incoming.KEPT_FREE_BYTES + 30
    monkeypatch.setattr(incoming.shutil, "disk_usage", lambda folder: usage(full, 0, full))
    refused, taken = announced(studio, {"a.bvh": b"x" * 20, "b.bvh": b"y" * 10})
    assert refused["job"]["state"] == "failed"
    assert codes(ended(studio, refused["job"]["id"])) == ["import.no_space"]
    real = Path.open

    def no_room(path: Path, *args: Any, **options: Any) -> Any:
        if path.name == "b.bvh":
            raise OSError(28, "No space left on device")
        return real(path, *args, **options)

    monkeypatch.setattr(Path, "open", no_room)
    answer = studio.http.put(f"/imports/{taken['job']['id']}", content=b"y" * 10)
    assert_error(answer, 500, "failed", "import.unwritable")
    assert left(studio) == []


def test_what_a_server_that_was_killed_left_goes(tmp_path):
    (tmp_path / f"{PREFIX}old" / "walk").mkdir(parents=True)
    kept = incoming.Incoming(tmp_path, [("a/b.bvh", 3), ("empty.bvh", 0), ("c.bvh", 1)])
    incoming.clear_left(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == [kept.folder.name]
    kept.write(b"xyz")
    kept.write(b"w")
    kept.end()
    assert (kept.folder / "a/b.bvh").read_bytes() == b"xyz" and (kept.folder / "c.bvh").read_bytes() == b"w"
    assert (kept.folder / "empty.bvh").read_bytes() == b""
    kept.discard()
    assert list(tmp_path.iterdir()) == []


def test_takes_that_another_program_made_are_told(recorded):
    stamp = Changes(recorded.sessions).stamp
    before = stamp()
    shutil.copytree(recorded.sessions / "tests/one", recorded.sessions / "tests/two")
    wait_until(lambda: stamp() != before, "it is seen")
    before = stamp()
    shutil.copytree(recorded.sessions / "tests", recorded.sessions / "more")
    wait_until(lambda: stamp() != before, "it is seen")
    before = stamp()
    time.sleep(2 * LOOK_S)
    assert stamp() == before
