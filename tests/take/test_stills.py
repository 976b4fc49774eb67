"""Single pictures of videos, in any order."""

import io

import numpy as np
import pytest
from PIL import Image

from studio.engine.base.errors import FormatError, StudioError
from studio.take.video.file import VideoFile
from studio.take.video.stills import Stills
from tests.refused import refused
from tests.take.video_files import turn, write_video
from tests.take.video_takes import BITS, HEIGHT, WIDTH, number_in, numbered_pictures


@pytest.fixture(scope="module")
def stills():
    made = Stills()
    yield made
    made.close()


def opened(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)).convert("L"))


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv", "a.webm", "a.avi"])
def test_every_picture_is_the_one_that_was_asked_for(stills, tmp_path, name):
    path = write_video(tmp_path / name, numbered_pictures(40), gop=11)
    at_ns = [time_ns for time_ns, _ in VideoFile.open(path).frames()]
    assert len(at_ns) == 40
    for number in (0, 1, 2, 30, 31, 5, 5, 39, 38, 0, 22):
        picture = opened(stills.picture(path, at_ns[number], 4000))
        assert picture.shape == (HEIGHT, WIDTH)
        assert number_in(picture[20, 10 : 20 * BITS : 20].astype(float)) == number


def test_a_picture_is_upright_and_no_wider_than_asked_for(stills, tmp_path):
    path = write_video(tmp_path / "a.mp4", [np.full((320, 640, 3), 90, np.uint8)] * 2)
    assert opened(stills.picture(path, 0, 160)).shape == (80, 160)
    turn(path)
    assert opened(stills.picture(path, 0, 160)).shape == (320, 160)


def test_variable_frame_rates_and_cut_off_files(stills, tmp_path):
    times_ms = [0, 10, 200, 233, 240, 900]
    path = write_video(tmp_path / "a.mkv", numbered_pictures(6), times_ms)
    for number in (5, 3, 4, 0, 2):
        picture = opened(stills.picture(path, times_ms[number] * 1_000_000, WIDTH))
        assert number_in(picture[20, 10 : 20 * BITS : 20].astype(float)) == number
    path = write_video(tmp_path / "cut.mkv", numbered_pictures(60))
    at_ns = [time_ns for time_ns, _ in VideoFile.open(path).frames()]
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    stills.picture(path, at_ns[3], WIDTH)
    with refused(FormatError, "video.no_picture"):
        stills.picture(path, at_ns[59], WIDTH)


def test_what_is_no_video_is_said_and_the_next_picture_comes(stills, tmp_path):
    text = tmp_path / "a.mp4"
    text.write_text("no video", encoding="utf-8")
    with refused(FormatError, "video.unreadable"):
        stills.picture(text, 0, 100)
    with refused(FormatError, "video.none"):
        stills.picture(tmp_path / "gone.mp4", 0, 100)
    path = write_video(tmp_path / "b.mp4", numbered_pictures(2))
    with refused(FormatError, "video.no_picture"):
        stills.picture(path, 7_000_000, 100)
    assert stills.picture(path, 0, 100)


def test_a_decoder_that_breaks_is_said_and_started_again(stills, tmp_path):
    path = write_video(tmp_path / "b.mp4", numbered_pictures(2))
    stills.picture(path, 0, 100)
    stills._process.kill()
    stills._process.join()
    assert stills.picture(path, 0, 100)
    stills._here.close()
    with refused(StudioError, "video.decoder_broke"):
        stills.picture(path, 0, 100)
    assert stills.picture(path, 0, 100)
