"""A take's timecode: kept, exported, and parts of the take by timecode; through the real commands."""

import json

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.engine.timecode.course import course
from studio.engine.timecode.timecode import RATES, Timecode
from studio.take.folder.solves import write_solve
from studio.take.folder.take import Take
from studio.take.timecode.kept import FILE, save_course, take_course
from tests.commands.program import one_line
from tests.commands.program import studio as program
from tests.poses_factory import random_poses
from tests.refused import refused

RATE = RATES["25"]


@pytest.fixture
def take(tmp_path):
    """Four seconds of poses, with timecode from 09:59:58:00 that was lost for a second."""
    made = Take.create(tmp_path / "walk", session="set", name="walk", source="live")
    poses = random_poses(np.random.default_rng(6), seconds=4.0)
    poses = Poses(**{**vars(poses), "time_s": poses.time_s + 1000.0})
    write_solve(made, "live", settings=preset("studio"), poses=poses, metrics={"frames": poses.frame_count})
    first = Timecode.parse("09:59:58:00", RATE).frame
    told = [(1000.0 + k / 25, first + k) for k in range(101) if not 40 < k < 65]
    made.meta["timecode_rate"] = "25"
    made.save_meta()
    save_course(made, course(told, RATE, "ltc"))
    return made


def test_it_comes_back(take):
    found = take_course(take, 1000.0)
    assert (found.rate, found.source, len(found.time_s)) == (RATE, "ltc", 77)
    assert str(found.timecodes_at(np.array([1002.0]))[0]) == "10:00:00:00"
    assert [round(end - begin, 2) for begin, end in found.gaps_s()] == [1.0]


def test_a_part_by_timecode_through_the_command(take, tmp_path):
    out = tmp_path / "part.csv"
    done = program(
        "export", take.path, "--format", "csv", "--out", out, "--timecode", "take",
        "--from", "09:59:59:00", "--to", "10:00:01:00", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    rows = out.read_text().splitlines()[1:]
    assert rows[0].endswith(",09:59:59:00") and rows[-1].endswith(",10:00:01:00")
    assert len(rows) == 121


def test_a_timeline_through_the_command(take, tmp_path):
    out = tmp_path / "walk.otio"
    done = program("export", take.path, "--format", "otio", "--out", out, "--timecode", "take", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    timeline = json.loads(out.read_text())
    assert timeline["global_start_time"] == {
        "OTIO_SCHEMA": "RationalTime.1", "rate": 25.0, "value": float(Timecode.parse("09:59:58:00", RATE).frame)
    }  # fmt: skip
    clip = timeline["tracks"]["children"][0]["children"][0]
    assert clip["name"] == "walk" and len(clip["markers"]) == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--from", "11:00:00:00"), "from=11:00:00:00: the take runs from 09:59:58:00 to 10:00:02:00"),
        (("--from", "10:00:00:25"), "not allowed at 25"),
        (("--timecode", "00:01:00;00", "--timecode-rate", "29.97df"), "not allowed at 29.97df"),
        (("--from", "10:00:01:00", "--to", "10:00:00:00"), "allowed is a number above start"),
    ],
)
def test_what_is_refused(take, tmp_path, options, words):
    done = program(
        "export", take.path, "--format", "bvh", "--out", tmp_path / "x.bvh", *options, cwd=tmp_path
    )
    assert words in one_line(done, 2)


def test_a_damaged_file(take):
    (take.path / FILE).write_bytes(b"PK")
    with refused(FormatError, "timecode.damaged"):
        take_course(take, 0.0)
    (take.path / FILE).unlink()
    take.meta["timecode"] = "noon"
    with refused(SettingsError, "timecode.text"):
        take_course(take, 0.0)
