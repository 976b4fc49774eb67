"""Videos become the landmarks of a take."""

from pathlib import Path

import numpy as np
import pytest

from studio import wire
from studio.engine.base.errors import FormatError, SettingsError
from studio.take.importers import import_recording
from studio.take.raw.frames import RawCamera, RawFrame, read_raw
from tests.refused import refused
from tests.take.sync_videos import heard, voices, write_film
from tests.take.video_files import real_pictures, turn, write_video

LIMBS = slice(11, 29)


@pytest.fixture(scope="module")
def person(test_data) -> list[np.ndarray]:
    return real_pictures(test_data / "rgb" / "pose2sim_single", "cam01", 4, every=5)


def landmarks(take) -> dict[str, list[tuple[int, wire.Landmarks, wire.LandmarkArrays]]]:
    """Every camera's frames: time [ns], message, arrays."""
    found: dict[str, list] = {}
    for record in read_raw(take.raw_path):
        if isinstance(record, RawCamera):
            assert record.hello.joint_set == "mediapipe" and record.hello.intrinsics is None
        elif isinstance(record, RawFrame):
            message = record.message
            arrays = wire.landmark_arrays(message, "mediapipe")
            found.setdefault(record.camera, []).append((message.device_time_ns, message.landmarks, arrays))
    return found


def test_a_folder_of_videos_becomes_a_take(person, test_data, tmp_path):
    folder = tmp_path / "shoot"
    folder.mkdir()
    other = real_pictures(test_data / "rgb" / "pose2sim_single", "cam02", 3)
    write_video(folder / "left.mp4", person, tags={"creation_time": "2024-05-06T07:08:09.000000Z"})
    write_video(folder / "my phone.mov", other, [0, 40, 95])
    (folder / "notes.txt").write_text("no video", encoding="utf-8")
    (folder / "depth.bag").write_bytes(b"")
    shares: list[float] = []
    take = import_recording(folder, tmp_path / "take", progress=shares.append)
    assert [*take.camera_names] == ["left", "my_phone"]
    assert shares == sorted(shares) and shares[-1] == 1.0
    found = landmarks(take)
    assert [time_ns // 1_000_000 for time_ns, *_ in found["my_phone"]] == [0, 40, 95]
    for frames in found.values():
        for _, message, arrays in frames:
            assert (message.width, message.height) == (360, 640)
            assert np.isfinite(arrays.pixels).all() and np.isfinite(arrays.world_m).all()
    assert take.meta["created"].startswith("2024-05-06T07:08:09")
    assert "left: recorded at 2024-05-06T07:08:09" in take.meta["notes"]
    assert "no videos: depth.bag" in take.meta["notes"]


def test_videos_with_sound_are_brought_to_one_clock(person, tmp_path):
    """Frames have the times of that clock, and the take says how sure it is."""
    folder, scene = tmp_path / "shoot", voices(12)
    folder.mkdir()
    for name, start_s in (("a", 0.0), ("b", 1.5)):
        sound = heard(scene, start_s, 6.0, seed=len(name))
        write_film(folder / f"{name}.mp4", 0.0, sound, pictures=person[:3])
    write_film(folder / "mute.mp4", 0.0, pictures=person[:2])
    take = import_recording(folder, tmp_path / "take", model="lite", sync="audio")
    found = landmarks(take)
    ahead_s = (found["b"][0][0] - found["a"][0][0]) * 1e-9
    assert ahead_s == pytest.approx(1.5, abs=0.003) and found["mute"][0][0] == 0
    assert take.common_clocks() == {"a": 0.1, "b": 0.1}
    assert "brought to one clock by audio: a 0.000 s, b 1.500 s" in take.meta["notes"]
    assert "mute has no sound" in take.meta["notes"]
    with refused(SettingsError, "import.only_videos"):
        import_recording(take.raw_path, tmp_path / "other", sync="audio")


def test_one_video_is_a_take_too(person, tmp_path):
    video = write_video(tmp_path / "one.mkv", person[:2])
    with refused(SettingsError, "value.unknown"):
        import_recording(video, tmp_path / "take", model="huge")
    take = import_recording(video, tmp_path / "take", model="lite")
    with refused(SettingsError, "import.only_videos"):
        import_recording(take.raw_path, tmp_path / "other", model="lite")
    assert [len(frames) for frames in landmarks(take).values()] == [2]


def test_a_phone_held_upright_gives_upright_pictures(person, tmp_path):
    """The file has the picture lying, and says how it is to be turned."""
    lying = [np.ascontiguousarray(np.rot90(picture)) for picture in person[:2]]
    straight = import_recording(write_video(tmp_path / "straight.mp4", person[:2]), tmp_path / "a")
    path = write_video(tmp_path / "turned.mp4", lying)
    turn(path)
    turned = import_recording(path, tmp_path / "b")
    (_, message, seen), (_, _, expected) = landmarks(turned)["turned"][0], landmarks(straight)["straight"][0]
    assert (message.width, message.height) == (360, 640)
    assert np.median(np.linalg.norm(seen.pixels - expected.pixels, axis=1)[LIMBS]) < 4


def test_a_large_picture_gives_pixels_of_the_large_one(person, tmp_path):
    large = [np.repeat(np.repeat(picture, 6, axis=0), 6, axis=1) for picture in person[:1]]
    small = import_recording(write_video(tmp_path / "small.mkv", person[:1]), tmp_path / "a")
    whole = import_recording(write_video(tmp_path / "large.mkv", large), tmp_path / "b")
    (_, message, seen), (_, _, expected) = landmarks(whole)["large"][0], landmarks(small)["small"][0]
    assert (message.width, message.height) == (2160, 3840)
    assert np.median(np.linalg.norm(seen.pixels / 6 - expected.pixels, axis=1)[LIMBS]) < 4


@pytest.mark.parametrize(("name", "options"), [("cut.mkv", {}), ("cut.mp4", {"movflags": "faststart"})])
def test_of_a_cut_off_video_what_is_there_is_read(person, tmp_path, name, options):
    path = write_video(tmp_path / name, person * 20, options=options)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    take = import_recording(path, tmp_path / "take")
    assert 20 < len(landmarks(take)["cut"]) < 60
    assert "cut.m" in take.meta["notes"] and "cut off" in take.meta["notes"]


def test_what_is_no_video_is_said(person, tmp_path):
    text = tmp_path / "text.mp4"
    text.write_text("no video", encoding="utf-8")
    headless = write_video(tmp_path / "headless.mp4", person[:2])
    headless.write_bytes(headless.read_bytes()[: headless.stat().st_size // 2])
    for path in (text, headless):
        with refused(FormatError, "video.unreadable"):
            import_recording(path, tmp_path / "take")
    assert not (tmp_path / "take").exists()


def test_videos_without_anybody_are_refused(tmp_path):
    empty = write_video(tmp_path / "empty.mkv", [np.full((240, 320, 3), 90, np.uint8)] * 3)
    with refused(FormatError, "import.nobody"):
        import_recording(empty, tmp_path / "take")


def test_frames_without_anybody_are_kept_as_unseen(person, tmp_path):
    gone = np.full_like(person[0], 90)
    take = import_recording(write_video(tmp_path / "gone.mkv", [person[0], gone, gone]), tmp_path / "take")
    seen = [bool(np.isfinite(arrays.pixels).any()) for *_, arrays in landmarks(take)["gone"]]
    assert seen == [True, False, False]


def test_two_files_of_one_name_are_refused(person, tmp_path):
    for name in ("a b.mp4", "a_b.mp4"):
        write_video(tmp_path / name, person[:1])
    with refused(FormatError, "import.one_name"):
        import_recording(tmp_path, tmp_path / "take")


def test_a_second_person_is_told(test_data, tmp_path):
    two = real_pictures(test_data / "rgb" / "pose2sim_two", "cam01", 2, small=2)
    take = import_recording(write_video(tmp_path / "two.mkv", two), tmp_path / "take")
    assert "2 people" in take.meta["notes"]


def test_a_take_of_videos_plays_as_a_camera(person, tmp_path):
    """Its frames keep their pictures."""
    from studio.camera.sources.recording import read_cameras

    take = import_recording(write_video(tmp_path / "one.mkv", person[:2]), tmp_path / "take")
    for path in (take.path, take.raw_path):
        (camera,) = read_cameras(Path(path)).values()
        pictures = [frame.picture for frame in camera.frames]
        assert all(one is not None and (one.width, one.height) == (360, 640) for one in pictures)


def test_a_player_that_is_late_goes_on_at_a_key_frame(person, tmp_path):
    from studio.take.video.file import VideoFile

    path = write_video(tmp_path / "long.mkv", person * 6, gop=5)
    times = [time_ns for time_ns, _ in VideoFile.open(path).frames(lambda: 300_000_000)]
    every = [time_ns for time_ns, _ in VideoFile.open(path).frames()]
    assert len(every) == 24 and times == every[10:]
