"""Timecode in exported files, as independent programs read it: bvhio, ezc3d, usd-core, OpenTimelineIO, ufbx."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.export import ExportOptions, export, export_takes
from studio.engine.base.errors import SettingsError
from studio.engine.model.poses import Poses
from studio.engine.timecode.course import TimecodeCourse, counted_from, course
from studio.engine.timecode.timecode import RATES, Timecode
from tests.engine.animation.export.readers.programs import read_with_bvhio, read_with_ufbx
from tests.poses_factory import random_poses
from tests.refused import refused

DROP = RATES["29.97df"]


@pytest.fixture
def poses() -> Poses:
    """Two seconds at stage times that begin at a fraction."""
    made = random_poses(np.random.default_rng(4), seconds=2.0)
    return replace(made, time_s=made.time_s + 41.337)


@pytest.fixture
def timecodes(poses: Poses) -> TimecodeCourse:
    """Timecode whose first frame is the last before a number that drop-frame leaves out."""
    return counted_from(Timecode.parse("00:00:59;29", DROP), poses.begins_s)


def test_csv_and_npz_have_that_of_every_frame(
    tmp_path: Path, poses: Poses, timecodes: TimecodeCourse
) -> None:
    for format in ("csv", "npz"):
        export(poses, tmp_path / f"x.{format}", format, timecodes=timecodes)
    with open(tmp_path / "x.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    with np.load(tmp_path / "x.npz") as data:
        assert data["timecode"].tolist() == [row["timecode"] for row in rows]
    assert [row["timecode"] for row in rows[:5]] == ["00:00:59;29"] * 2 + ["00:01:00;02"] * 2 + [
        "00:01:00;03"
    ]
    Poses.load(tmp_path / "x.npz")
    export(poses, tmp_path / "plain.csv", "csv")
    assert "timecode" not in (tmp_path / "plain.csv").read_text()


def test_bvh_has_it_where_readers_do_not_stumble(
    tmp_path: Path, poses: Poses, timecodes: TimecodeCourse
) -> None:
    export(poses, tmp_path / "x.bvh", "bvh", timecodes=timecodes)
    assert (tmp_path / "x.bvh").read_text().startswith("HIERARCHY # timecode 00:00:59;29 29.97df\n")
    assert len(read_with_bvhio(tmp_path / "x.bvh").positions_cm) == poses.frame_count


def test_c3d(tmp_path: Path, poses: Poses, timecodes: TimecodeCourse) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    export(poses, tmp_path / "x.c3d", "c3d", timecodes=timecodes)
    group = ezc3d.c3d(str(tmp_path / "x.c3d"))["parameters"]["TIMECODE"]
    assert group["START"]["value"] == ["00:00:59;29"] and group["RATE"]["value"] == ["29.97df"]
    assert group["DROP_FRAME"]["value"] == [1]
    assert group["FRAMES_PER_SECOND"]["value"][0] == pytest.approx(30 / 1.001)


def test_usd(tmp_path: Path, poses: Poses, timecodes: TimecodeCourse) -> None:
    usd = pytest.importorskip("pxr.Usd")
    export(poses, tmp_path / "x.usda", "usd", timecodes=timecodes, mesh=False)
    stage = usd.Stage.Open(str(tmp_path / "x.usda"))
    told = stage.GetRootLayer().customLayerData
    assert told == {"timecode": "00:00:59;29", "timecodeRate": "29.97df"}


def test_fbx_keys_begin_at_it(tmp_path: Path, poses: Poses, timecodes: TimecodeCourse) -> None:
    export(poses, tmp_path / "x.fbx", "fbx", timecodes=timecodes, fps=29.97, start_s=1.0)
    back = read_with_ufbx(tmp_path / "x.fbx", hz=30)
    assert back.scene["begin_s"] == pytest.approx((1799 + 30) * 1.001 / 30, abs=0.02)
    shown = back.scene["begin_s"] * 30 / 1.001
    assert shown == pytest.approx(round(shown), abs=1e-3)  # keys lie on frames


def test_a_part_after_a_jump_has_its_own(tmp_path: Path, poses: Poses) -> None:
    rate, begin = RATES["25"], poses.begins_s
    before = [(begin + k / 25, 1000 + k) for k in range(25)]
    after = [(begin + 1 + k / 25, 90_000 + k) for k in range(26)]
    export(poses, tmp_path / "x.bvh", "bvh", timecodes=course(before + after, rate, "ltc"), start_s=1.5)
    assert (tmp_path / "x.bvh").read_text().startswith("HIERARCHY # timecode 01:00:00:12 25\n")


def test_opentimelineio(tmp_path: Path, poses: Poses, timecodes: TimecodeCourse) -> None:
    otio = pytest.importorskip("opentimelineio")
    later = counted_from(Timecode.parse("00:01:10;00", DROP), poses.begins_s)
    takes = [
        (poses, ExportOptions(timecodes=later, take_name="second")),
        (poses, ExportOptions(timecodes=timecodes, take_name="first")),
    ]
    export_takes(takes, tmp_path / "x.otio", "otio")
    timeline = otio.adapters.read_from_file(str(tmp_path / "x.otio"))
    assert timeline.global_start_time.to_timecode() == "00:00:59;29"
    clips = list(timeline.find_clips())
    assert [clip.name for clip in clips] == ["first", "second"]
    assert [clip.source_range.start_time.to_timecode() for clip in clips] == ["00:00:59;29", "00:01:10;00"]
    assert clips[0].source_range.duration.value == 60  # of 2 s
    assert clips[0].media_reference.target_url == "first.fbx"
    track = timeline.video_tracks()[0]
    begins = track.range_of_child(clips[1]).start_time + timeline.global_start_time
    assert begins.to_timecode() == "00:01:10;00"
    again = otio.adapters.write_to_string(timeline, "otio_json")
    assert otio.adapters.read_from_string(again, "otio_json").is_equivalent_to(timeline)


def test_opentimelineio_marks_what_was_bridged(tmp_path: Path, poses: Poses) -> None:
    otio = pytest.importorskip("opentimelineio")
    rate = RATES["50"]
    told = [(poses.begins_s + k / 50, 500_000 + k) for k in range(101) if not 30 < k < 60]
    export(poses, tmp_path / "x.otio", "otio", timecodes=course(told, rate, "ltc"))
    (clip,) = otio.adapters.read_from_file(str(tmp_path / "x.otio")).find_clips()
    (marker,) = clip.markers
    assert marker.marked_range.start_time.value == pytest.approx(500_032, abs=3)
    assert marker.marked_range.duration.value == pytest.approx(27, abs=3)


def test_takes_that_no_timeline_holds(tmp_path: Path, poses: Poses, timecodes: TimecodeCourse) -> None:
    other = counted_from(Timecode.parse("10:00:00:00", RATES["25"]), poses.begins_s)
    with refused(SettingsError, "export.otio_rates"):
        takes = [(poses, ExportOptions(timecodes=timecodes)), (poses, ExportOptions(timecodes=other))]
        export_takes(takes, tmp_path / "x.otio", "otio")
    with refused(SettingsError, "export.otio_overlap"):
        export_takes([(poses, ExportOptions(timecodes=other))] * 2, tmp_path / "x.otio", "otio")
    with refused(SettingsError, "export.not_for_format"):
        export(poses, tmp_path / "x.glb", "glb", timecodes=other)
    assert not list(tmp_path.iterdir())
