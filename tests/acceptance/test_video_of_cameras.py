"""A camera client records its video during a take; the studio fetches it afterwards, whatever is killed meanwhile."""

import hashlib
import subprocess
import sys
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from studio.take.folder.take import Take
from studio.take.raw.frames import RawCamera, RawFrame, read_raw
from studio.take.raw.membership import STRANGER
from studio.take.video.file import VideoFile
from studio.take.video.kept import KeptVideo, kept_videos
from studio.take.video.seen import video_seen
from tests.acceptance.processes import ServerProcess, server_process, wait_until
from tests.take.video_files import write_video
from tests.take.video_takes import BITS, number_in, numbered_pictures

PICTURES, RATE_HZ = 40, 10
WRITTEN = round(1.5 * RATE_HZ)
"""Pictures after which some of a part can be read: a second of them is written at a time."""


class VideoClient:
    """`studio camera --keep-video` that plays a video."""

    def __init__(self, folder: Path, video: Path, url: str) -> None:
        self.videos = folder / "spool" / "video"
        self.log = folder / "camera.log"
        source = f"video:{video}?model=lite&no-hands"
        self._command = [sys.executable, "-m", "studio", "camera", "--source", source]
        self._command += [
            "--name",
            "phone",
            "--server",
            url,
            "--spool",
            str(folder / "spool"),
            "--keep-video",
        ]
        self.start()

    def start(self) -> None:
        with self.log.open("a") as log:
            self.process = subprocess.Popen(self._command, stdout=log, stderr=subprocess.STDOUT)

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def parts(self) -> int:
        """How many parts have pictures."""
        return sum(file.stat().st_size > 8 * WRITTEN for file in self.videos.glob("*.times"))

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.terminate()
            assert self.process.wait(60) == 0, self.log.read_text()


def videos_of(path: Path) -> list[KeptVideo]:
    return kept_videos(path).get("phone", [])


def check_pictures(video: KeptVideo, period_ns: int) -> None:
    """Each picture was taken at the moment that it shows: the player's time tells its number."""
    frames = list(VideoFile.open(video.path).frames())
    assert len(frames) == len(video.times_ns) > 0  # a part is as long as the client had time for it
    for (_, frame), time_ns in zip(frames, video.times_ns.tolist(), strict=True):
        assert frame.width % 2 == 0
        bars = frame.to_ndarray(format="gray")[20, 10 : 20 * BITS : 20].astype(float)
        assert number_in(bars) == round(time_ns % period_ns * 1e-9 * RATE_HZ)
    with av.open(str(video.path)) as container:
        assert container.streams.video[0].codec_context.name == "h264"


def described(take: Take, file: Path, **change: Any) -> dict[str, Any]:
    """A description of a part as the client of the take could send it."""
    kept = videos_of(take.path)
    video = [one for one in kept if one.boot_id == kept[0].boot_id][-1]  # after it the client was killed
    data = file.read_bytes()
    first_ns = int(video.times_ns[-1]) + 40_000_000
    return {
        "take_id": take.meta.get("take_id"), "name": "phone", "boot_id": video.boot_id, "from_sequence": 0,
        "size": len(data), "sha256": hashlib.sha256(data).hexdigest(), "ending": ".mp4",
        "times_ns": [first_ns, first_ns + 33_000_000],
    } | change  # fmt: skip


def check_hostile(server: ServerProcess, take: Take, folder: Path) -> None:
    """Videos that do not belong to the take are refused."""
    text = folder / "text.mp4"
    text.write_bytes(b"no video")
    before = {file: file.read_bytes() for file in take.path.rglob("*") if file.is_file()}

    def ask(**change: Any) -> tuple[int, dict[str, Any]]:
        answer = server.http.post("/video", json=described(take, text, **change))
        return answer.status_code, answer.json()

    assert ask(take_id="other")[1]["state"] == "unknown"
    for stranger in ({"boot_id": "other"}, {"name": "other"}):
        state = ask(**stranger)[1]
        assert (state["state"], state["reason"]) == ("unwanted", STRANGER)
    late_ns = int(videos_of(take.path)[-1].times_ns[-1]) + 3_600_000_000_000
    boot_id = videos_of(take.path)[-1].boot_id
    assert ask(boot_id=boot_id, times_ns=[late_ns, late_ns + 1])[1]["state"] == "unwanted"
    for wrong in (
        {"name": "../up"}, {"ending": ".sh"}, {"size": 1 << 40}, {"times_ns": []}, {"times_ns": [5, 5]},
        {"sha256": "../../x"}, {"take_id": ""}, {"more": 1},
    ):  # fmt: skip
        assert ask(**wrong)[0] == 422, wrong
    part = ask()[1]
    assert part["state"] == "wanted" and part["received"] == 0
    assert server.http.put(f"/video/{part['id']}?at=5", content=b"x").json()["received"] == 0
    assert server.http.put(f"/video/{part['id']}?at=0", content=b"no").json()["received"] == 2
    assert ask()[1]["received"] == 2  # goes on after a cut link
    assert server.http.put(f"/video/{part['id']}?at=2", content=b" video and more").status_code == 422
    part = ask()[1]
    assert server.http.put(f"/video/{part['id']}?at=0", content=b"no video").json()["state"] == "unwanted"
    assert server.http.put("/video/..%2F..%2Fup?at=0", content=b"x").status_code == 404
    assert server.http.put("/video/up?at=0", content=b"x").json()["state"] == "unknown"
    assert {file: file.read_bytes() for file in take.path.rglob("*") if file.is_file()} == before
    assert not any(file.is_file() for file in (server.sessions / ".video").rglob("*"))


@pytest.mark.timeout(900)
def test_the_video_of_a_take_comes_after_it_though_the_client_was_killed(tmp_path: Path) -> None:
    times_ms = [round(k * 1000 / RATE_HZ) for k in range(PICTURES)]
    source = write_video(tmp_path / "numbers.mp4", numbered_pictures(PICTURES), times_ms, gop=4)
    period_ns = round(VideoFile.open(source).duration_s * 1e9) + 500_000_000
    with server_process(tmp_path / "sessions") as server:
        client = VideoClient(tmp_path, source, server.url)
        try:
            wait_until(lambda: server.live_cameras() == 1, "the camera sends")
            path = server.record("filmed")
            wait_until(lambda: client.parts() == 2, "it begins a second part")
            client.kill()
            client.start()
            wait_until(lambda: client.parts() == 3, "it records again after its start")
            assert not videos_of(path)  # nothing is fetched while the take is recorded
            server.stop()
            wait_until(lambda: len(videos_of(path)) == 3, "the videos have come")
            wait_until(lambda: client.parts() == 0, "the client has let go of them")
            take = Take.open(path)
            boots = [video.boot_id for video in videos_of(path)]
            assert len(set(boots)) == 2 and all(boot in take.meta["cameras"][0]["boot_ids"] for boot in boots)
            for video in videos_of(path):
                check_pictures(video, period_ns)
            check_hostile(server, take, tmp_path)
        finally:
            client.close()
    seen = video_seen(take, videos_of(path))
    assert (np.diff(seen.times_ns) > 0).all() and len(seen.times_ns) == sum(
        len(v.times_ns) for v in videos_of(path)
    )
    hellos = [record for record in read_raw(take.raw_path) if isinstance(record, RawCamera)]
    frames = [record for record in read_raw(take.raw_path) if isinstance(record, RawFrame)]
    filmed = {(video.boot_id, time_ns) for video in videos_of(path) for time_ns in video.times_ns.tolist()}
    both = sum((frame.boot_id, frame.message.device_time_ns) in filmed for frame in frames)
    print(
        f"{len(hellos)} starts; {both} of {len(frames)} frames of landmarks have their picture in the video"
    )
    assert both > 0.5 * len(frames)


def test_a_source_without_video_says_so(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "studio", "camera", "--source", "simulated-rgb:0/2", "--keep-video"]
    done = subprocess.run(
        [*command, "--spool", str(tmp_path)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode != 0 and "has no video" in done.stderr
