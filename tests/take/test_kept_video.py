"""A take keeps the videos of its cameras: linked or copied, with times, in bundles, in the trash."""

import json
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, TakeError
from studio.engine.model.frames import ClockModel
from studio.take.folder.take import Take
from studio.take.importers import import_recording
from studio.take.library.bundle import read_bundle, write_bundle
from studio.take.library.index import TakeIndex
from studio.take.library.sessions import take_info
from studio.take.library.trash import empty_trash, list_trash, restore, throw_video_away
from studio.take.raw.clocks import TakeClocks
from studio.take.raw.live_log import SegmentEvent, clock_event
from studio.take.video.file import VideoFile
from studio.take.video.kept import has_video, keep_video, kept_videos, numbered, video_bytes
from studio.take.video.seen import video_seen
from tests.refused import refused
from tests.take.video_files import real_pictures, write_video
from tests.take.video_takes import (
    AHEAD_NS,
    COUNT,
    capture_ns,
    landmark_pixels,
    numbered_pictures,
    take_with_video,
)


@pytest.fixture
def take(tmp_path) -> Take:
    return take_with_video(tmp_path / "sessions" / "monday" / "one", solved=False)


def test_an_import_keeps_its_videos_with_the_times_of_the_landmarks(test_data, tmp_path):
    person = real_pictures(test_data / "rgb" / "pose2sim_single", "cam01", 3)
    folder = tmp_path / "shoot"
    folder.mkdir()
    file = write_video(folder / "my phone.mov", person, [0, 40, 95])
    take = import_recording(folder, tmp_path / "take")
    (video,) = kept_videos(take.path)["my_phone"]
    assert os.path.samefile(video.path, file)  # one disk: linked
    assert video.at_ns.tolist() == video.times_ns.tolist() == [0, 40_000_000, 95_000_000]
    assert [time_ns for time_ns, _ in VideoFile.open(video.path).frames()] == video.at_ns.tolist()
    assert not has_video(import_recording(folder, tmp_path / "without", keep_videos=False).path)


def test_a_video_on_another_disk_is_copied(take, tmp_path, monkeypatch):
    def no_link(*_: object) -> None:
        raise OSError(18, "Invalid cross-device link")

    monkeypatch.setattr(os, "link", no_link)
    file = write_video(tmp_path / "b.mkv", numbered_pictures(3))
    at_ns = np.arange(3) * 1_000_000
    video = keep_video(take, file, camera="left", boot_id="b", at_ns=at_ns, times_ns=at_ns + 9)
    assert video.path.read_bytes() == file.read_bytes() and not os.path.samefile(video.path, file)
    assert video.path.name == "00002.mkv"
    assert not [one for one in video.path.parent.iterdir() if one.name.startswith(".")]


def test_a_full_disk_is_said(take, tmp_path, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "link", full)
    monkeypatch.setattr("shutil.copyfile", full)
    file = write_video(tmp_path / "b.mkv", numbered_pictures(3))
    at_ns = np.arange(3) * 1_000_000
    with refused(TakeError, "video.not_kept"):
        keep_video(take, file, camera="left", boot_id="b", at_ns=at_ns, times_ns=at_ns)
    assert len(kept_videos(take.path)["left"]) == 1


@pytest.mark.parametrize(
    ("name", "times", "code"),
    [("a.sh", [0, 1], "video.ending"), ("a.mp4", [0, 0], "video.times"), ("a.mp4", [], "video.times")],
)
def test_what_does_not_fit_is_refused(take, tmp_path, name, times, code):
    file = tmp_path / name
    file.write_bytes(b"")
    times_ns = np.array(times, np.int64)
    with refused(FormatError, code):
        keep_video(take, file, camera="left", boot_id="b", at_ns=times_ns, times_ns=times_ns)


def test_a_camera_never_leads_out_of_the_take(take, tmp_path):
    file = write_video(tmp_path / "b.mkv", numbered_pictures(3))
    at_ns = np.arange(3) * 1_000_000
    with refused(TakeError, "name.leads_out"):
        keep_video(take, file, camera="../../up", boot_id="b", at_ns=at_ns, times_ns=at_ns)
    described = next((take.path / "video" / "left").glob("*.json"))
    value = json.loads(described.read_text())
    described.write_text(json.dumps({**value, "file": "../../../take.json"}))
    assert kept_videos(take.path) == {}


@pytest.mark.parametrize(
    "change",
    [
        {"format_version": 9},
        {"at_ns": [1]},
        {"times_ns": "no"},
        {"camera": None, "at_ns": [3, 2]},
        {"file": "gone.mp4"},
    ],
)
def test_a_description_that_cannot_be_read_counts_as_none(take, change):
    described = next((take.path / "video" / "left").glob("*.json"))
    described.write_text(json.dumps({**json.loads(described.read_text()), **change}))
    assert kept_videos(take.path) == {}


def test_pictures_and_landmarks_are_on_one_clock(take):
    videos = kept_videos(take.path)["left"]
    seen = video_seen(take, videos)
    assert seen.times_ns.tolist() == seen.pose_times_ns.tolist() == capture_ns().tolist()
    assert seen.numbers.tolist() == list(range(COUNT)) and seen.times_ns[0] == AHEAD_NS
    size = np.array(seen.size)
    np.testing.assert_allclose(seen.pixels[7] * size - 0.5, landmark_pixels(7), atol=1e-4)
    video, at_ns = numbered(videos, 7)
    assert video is videos[0] and at_ns == 233_000_000
    with pytest.raises(IndexError):
        numbered(videos, COUNT)


def test_a_clock_that_had_jumped_before_the_take_is_known():
    clocks = TakeClocks()
    for clock_id, offset_ns in (("a#1", 50), ("b", 70)):
        clocks.event(clock_event("left", clock_id, ClockModel(offset_ns)))
    assert clocks.stage_ns("left", "a", 5, 1000) == 1050
    assert clocks.placed_ns("left", "a", 5, 1000) == 980 and clocks.placed_ns("left", "b", 5, 1000) == 1000
    clocks.event(SegmentEvent("left", "a", 9, "a#2"))
    clocks.event(clock_event("left", "a#2", ClockModel(60)))
    assert clocks.stage_ns("left", "a", 8, 1000) == 1050 and clocks.stage_ns("left", "a", 9, 1000) == 1060


def test_a_bundle_has_the_video(take, tmp_path):
    out = tmp_path / "one.take.zip"
    write_bundle(take, out)
    with zipfile.ZipFile(out) as bundle:
        stored = {one.filename: one.compress_type for one in bundle.infolist()}
    assert stored["video/left/00001.mp4"] == zipfile.ZIP_STORED
    other = read_bundle(out, tmp_path / "sessions" / "monday" / "two")
    assert [video.times_ns.tolist() for video in kept_videos(other.path)["left"]] == [capture_ns().tolist()]


def test_the_video_alone_is_thrown_away_and_comes_back(take):
    sessions: Path = take.path.parents[1]
    index = TakeIndex(sessions)
    size = video_bytes(take.path)
    assert index.search().takes[0].video_bytes == take_info(take.path).video_bytes == size > 1000
    thrown = throw_video_away(sessions, "monday", "one")
    assert thrown.video and list_trash(sessions) == [thrown]
    assert not has_video(take.path) and Take.open(take.path).meta.get("video_unwanted")
    assert index.search().takes[0].video_bytes == 0
    with refused(TakeError, "trash.no_video"):
        throw_video_away(sessions, "monday", "one")
    assert restore(sessions, thrown.id) == ("monday", "one")
    assert video_bytes(take.path) == size and "video_unwanted" not in Take.open(take.path).meta
    again = throw_video_away(sessions, "monday", "one")
    assert empty_trash(sessions, again.id) == 1 and not has_video(take.path)
