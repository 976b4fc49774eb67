"""Importing made-up recordings: what is read, and one clear line for what cannot be."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, StudioError, TakeError
from studio.engine.model.joints import INDEX, JOINT_SETS
from studio.take.importers import import_recording
from studio.take.importers.kinect_v2 import joint_set
from studio.take.raw.frames import camera_frames, inspect_raw
from tests.refused import refused
from tests.take.helpers import joints_header, joints_rows, write_csv


def recording(folder: Path, cameras: int = 2, count: int = 5) -> Path:
    for k in range(cameras):
        rows = joints_rows(count, start_s=0.1 * k)
        write_csv(folder / f"camera_{k}" / "joints.csv", joints_header(), rows)
    return folder


def kinect_rows(tracker_ms: int, ticks: int, person: int, camera: str, value: float) -> list[str]:
    return [str(tracker_ms), str(person), str(ticks), camera, *[f"{value:.3f}"] * 75]


def kinect_header() -> list[str]:
    joints = sorted(JOINT_SETS["kinect-v2"])
    names = [f"{name}_{axis}" for name in joints for axis in "XYZ"]
    return ["Tracker_Time", "Person_Id", "Skeleton_Time", "Kinect_Id", *names]


def test_a_folder_of_joints_becomes_a_take(tmp_path: Path) -> None:
    source = recording(tmp_path / "in", cameras=11)
    (source / "recording.json").write_text('{"calibration_s": 34.3}')
    shares: list[float] = []
    take = import_recording(source, tmp_path / "out", progress=shares.append)
    assert take.camera_names == tuple(f"camera_{k}" for k in range(11))
    assert take.meta["calibration_s"] == 34.3 and take.meta["source"] == "import"
    assert take.meta["recording"] == "done"
    assert take.meta["cameras"][0]["frames_per_second"] == pytest.approx(30, abs=0.1)
    assert shares == sorted(shares) and shares[-1] == 1.0
    frames = camera_frames(take.raw_path)
    row = [float(v) for v in joints_rows(5)[3]]
    assert [f.device_time_ns for f in frames["camera_1"]] == [
        round(float(r[0]) * 1e9) for r in joints_rows(5, start_s=0.1)
    ]
    column = joints_header().index("left_knee_x")
    frame = frames["camera_0"][3]
    np.testing.assert_allclose(frame.positions[INDEX["left_knee"]], row[column : column + 3], atol=1e-6)
    assert frame.confidence[INDEX["left_knee"]] == pytest.approx(row[column + 3], abs=1e-6)
    assert inspect_raw(take.raw_path).complete


def test_columns_are_found_by_name_and_empty_is_unseen(tmp_path: Path) -> None:
    header = ["head_confidence", "head_z", "note", "time_s", "head_x", "head_y"]
    rows = [
        ["0.5", "3", "a", "1", "0.25", "-1"],
        ["0.5", "", "b", "2", "0.25", "-1"],
        ["", "", "", "3", "", ""],
    ]
    write_csv(tmp_path / "in" / "camera_0" / "joints.csv", header, rows)
    frames = camera_frames(import_recording(tmp_path / "in", tmp_path / "out").raw_path)["camera_0"]
    np.testing.assert_array_equal(frames[0].positions[INDEX["head"]], [0.25, -1, 3])
    assert frames[0].confidence[INDEX["head"]] == 0.5
    for frame in frames[1:]:
        assert np.isnan(frame.positions).all() and (frame.confidence == 0).all()
    assert np.isnan(frames[0].positions[INDEX["neck"]]).all()


def test_a_calibration_that_comes_along_is_used_as_it_stands(tmp_path: Path) -> None:
    source = recording(tmp_path / "in")
    T = [[1, 0, 0, 0.5], [0, 0, 1, -3], [0, -1, 0, 1], [0, 0, 0, 1]]
    (source / "calibration.json").write_text(json.dumps({"cameras": {"camera_0": {"T_stage_camera": T}}}))
    take = import_recording(source, tmp_path / "out")
    assert take.meta["calibration"] == 1
    assert take.calibration().cameras["camera_0"].T_stage_camera.tolist() == T
    assert "camera_1" in take.meta["notes"]


def test_time_that_goes_back_repeats_or_is_negative_is_told(tmp_path: Path) -> None:
    rows = joints_rows(5)
    for row, time in zip(rows, ("-0.1", "0.3", "0.2", "0.3", "0.4"), strict=True):
        row[0] = time
    write_csv(tmp_path / "in" / "camera_0" / "joints.csv", joints_header(), rows)
    take = import_recording(tmp_path / "in", tmp_path / "out")
    times = [f.device_time_ns for f in camera_frames(take.raw_path)["camera_0"]]
    assert times == [200_000_000, 300_000_000, 400_000_000]
    for words in ("backwards at 1 of 5", "1 rows repeat", "1 rows before time 0"):
        assert words in take.meta["notes"]


def _drop(header: list[str], *names: str) -> list[str]:
    return [name for name in header if name not in names]


def _changed(row: int, column: str, text: str) -> tuple[list[str], list[list[str]]]:
    rows = joints_rows(4)
    rows[row][joints_header().index(column)] = text
    return joints_header(), rows


BROKEN_JOINTS: dict[str, tuple[tuple[list[str], list[list[str]]], str, dict[str, object]]] = {
    "no time": (
        (_drop(joints_header(), "time_s"), []),
        "import.joint_columns_missing",
        {"names": ["time_s"]},
    ),
    "no coordinate": (
        (_drop(joints_header(), "head_y", "left_toe_confidence"), []),
        "import.joint_columns_missing",
        {"names": ["head_y", "left_toe_confidence"]},
    ),
    "no joint": ((["time_s", "frame"], [["1", "2"]]), "import.no_joint", {}),
    "unknown joint": (
        (["time_s", "nose_x", "nose_y", "nose_z", "nose_confidence"], []),
        "import.unknown_joints",
        {"names": ["nose"]},
    ),
    "column twice": (([*joints_header(), "head_x"], []), "import.columns_twice", {"names": ["head_x"]}),
    "short row": (
        (joints_header(), [*joints_rows(2), ["1", "2"]]),
        "import.row_cut",
        {"line": 4, "n": 2, "count": 85},
    ),
    "text": (_changed(2, "neck_y", "high"), "import.not_finite_number", {"line": 4, "text": "high"}),
    "not finite": (_changed(1, "neck_y", "inf"), "import.not_finite_number", {"line": 3, "text": "inf"}),
    "no time in a row": (_changed(0, "time_s", ""), "import.not_finite_number", {"line": 2, "text": ""}),
    "far time": (_changed(0, "time_s", "1e12"), "import.time_too_large", {"line": 2}),
    "confidence": (_changed(3, "neck_confidence", "1.5"), "import.confidence", {"line": 5, "value": 1.5}),
    "no rows": ((joints_header(), []), "import.no_rows", {}),
    "only negative times": ((joints_header(), joints_rows(3, start_s=-5.0)), "import.no_row_from_zero", {}),
}


@pytest.mark.parametrize("case", BROKEN_JOINTS)
def test_a_broken_joints_csv_is_one_line_and_leaves_nothing(tmp_path: Path, case: str) -> None:
    (header, rows), code, values = BROKEN_JOINTS[case]
    recording(tmp_path / "in", cameras=1)
    write_csv(tmp_path / "in" / "camera_1" / "joints.csv", header, rows)
    with refused(FormatError, code, **values) as caught:
        import_recording(tmp_path / "in", tmp_path / "a" / "out")
    assert "\n" not in str(caught.value)
    assert [f.name for f in tmp_path.iterdir()] == ["in"]


@pytest.mark.parametrize("data", [b"", b"\xff\xfe\x00", b"time_s\x00,head_x", b'"' + b"a" * 200_000])
def test_bytes_that_are_no_csv_are_told(tmp_path: Path, data: bytes) -> None:
    file = tmp_path / "in" / "camera_0" / "joints.csv"
    file.parent.mkdir(parents=True)
    file.write_bytes(data)
    with refused(FormatError, "import.not_csv", "import.joint_columns_missing"):
        import_recording(tmp_path / "in", tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("calibration.json", "{"),
        ("calibration.json", '{"cameras": {}}'),
        ("calibration.json", '{"cameras": {"camera_0": {"T_stage_camera": [[1]]}}}'),
        ("calibration.json", json.dumps({"cameras": {"other": {"T_stage_camera": np.eye(4).tolist()}}})),
        ("recording.json", "{"),
        ("recording.json", "[]"),
        ("recording.json", '{"calibration_s": "34"}'),
        ("recording.json", '{"calibration_s": -1}'),
        ("recording.json", '{"calibration_s": NaN}'),
    ],
)
def test_a_broken_file_beside_the_cameras_is_told(tmp_path: Path, name: str, text: str) -> None:
    source = recording(tmp_path / "in")
    (source / name).write_text(text)
    with pytest.raises(FormatError) as error:
        import_recording(source, tmp_path / "out")
    assert error.value.values["path"] == str(source / name)
    assert not (tmp_path / "out").exists()


def test_what_cannot_be_imported_is_told(tmp_path: Path) -> None:
    with refused(FormatError, "import.none"):
        import_recording(tmp_path / "missing", tmp_path / "out")
    for name in ("x.mkv", "x.BAG", "x.db3", "x.mcap", "x.bvh", "x.c3d", "x.trc", "x.glb"):
        (tmp_path / name).write_bytes(b"\x00")
        with pytest.raises(FormatError) as error:
            import_recording(tmp_path / name, tmp_path / "out")
        assert error.value.values["path"] == str(tmp_path / name)
    (tmp_path / "depth" / "camera_0").mkdir(parents=True)
    (tmp_path / "depth" / "camera_0" / "depth.txt").write_text("")
    with refused(FormatError, "import.camera_json"):
        import_recording(tmp_path / "depth", tmp_path / "out")
    (tmp_path / "letter.txt").write_text("Dear Ada,\n")
    for unknown in (tmp_path / "letter.txt", tmp_path / "depth" / "camera_0"):
        with refused(FormatError, "import.unknown_kind"):
            import_recording(unknown, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_camera_without_frames_is_not_left_out_silently(tmp_path: Path) -> None:
    source = recording(tmp_path / "in")
    (source / "camera_2").mkdir()
    with refused(FormatError, "import.camera_folder_empty", names=["camera_2"]):
        import_recording(source, tmp_path / "out")


def test_a_take_is_neither_overwritten_nor_imported(tmp_path: Path) -> None:
    source = recording(tmp_path / "in")
    take = import_recording(source, tmp_path / "out")
    before = take.raw_path.read_bytes()
    with refused(TakeError, "take.not_empty"):
        import_recording(source, tmp_path / "out")
    with refused(TakeError, "import.is_take"):
        import_recording(take.path, tmp_path / "other")
    assert take.raw_path.read_bytes() == before


def test_two_kinects(tmp_path: Path) -> None:
    start = 63_562_209_737_035
    rows = [
        kinect_rows(start, 900_000_000, 0, "left", 0.5),
        kinect_rows(start + 20, 5_000, 0, "right", 1.5),
        kinect_rows(start + 33, 900_330_000, 0, "left", 0.6),
        kinect_rows(start + 53, 5_000, 0, "right", 1.5),  # no new frame
        kinect_rows(start + 66, 900_330_000, 1, "left", 9.0),  # another person
        kinect_rows(start + 80, 335_000, 0, "right", -9999.0),
    ]
    take = import_recording(write_csv(tmp_path / "pair.csv", kinect_header(), rows), tmp_path / "out")
    frames = camera_frames(take.raw_path)
    assert {name: [f.device_time_ns for f in of] for name, of in frames.items()} == {
        "camera_0": [0, 33_000_000],
        "camera_1": [20_000_000, 53_000_000],
    }
    np.testing.assert_allclose(frames["camera_0"][1].positions[INDEX["hips"]], [-0.6, -0.6, 0.6], atol=1e-6)
    assert np.isnan(frames["camera_1"][1].positions).all() and (frames["camera_1"][1].confidence == 0).all()
    assert (frames["camera_0"][0].confidence == 1).all()
    assert take.meta["created"] == "2015-03-17T17:22:17+00:00"
    assert [c["serial"] for c in take.meta["cameras"]] == ["left", "right"]
    assert [one.body for one in frames["camera_0"][1].bodies()] == [0, 1]
    for words in ("1 rows repeat a time", "no confidence", "no calibration by these persons"):
        assert words in take.meta["notes"]


@pytest.mark.parametrize(
    ("column", "text", "code", "values"),
    [
        (
            "Skeleton_Time",
            "soon",
            "import.not_whole_number",
            {"column": "Skeleton_Time", "line": 2, "text": "soon"},
        ),
        ("Tracker_Time", "9" * 30, "import.not_whole_number", {"column": "Tracker_Time", "line": 2}),
        ("Head_X", "", "import.not_finite_number", {"column": "Head_X", "line": 2}),
    ],
)
def test_a_broken_row_of_two_kinects_is_told(
    tmp_path: Path, column: str, text: str, code: str, values: dict[str, Any]
) -> None:
    row = kinect_rows(63_562_209_737_035, 9, 0, "k", 1.0)
    row[kinect_header().index(column)] = text
    with refused(FormatError, code, **values):
        import_recording(write_csv(tmp_path / "pair.csv", kinect_header(), [row]), tmp_path / "out")


def test_a_column_that_two_kinects_lack_is_named(tmp_path: Path) -> None:
    header = _drop(kinect_header(), "HandTipLeft_Z", "Person_Id")
    with refused(FormatError, "import.columns_missing", names=["Person_Id", "HandTipLeft_Z"]):
        import_recording(write_csv(tmp_path / "pair.csv", header, []), tmp_path / "out")
    with refused(FormatError, "import.no_rows"):
        import_recording(write_csv(tmp_path / "pair.csv", kinect_header(), []), tmp_path / "out")


def test_kinect_states_become_confidence(tmp_path: Path) -> None:
    row = ["1000", *["0.5", "1", "3", "2"] * 24, "0.5", "1", "3", "1", ""]
    row[4] = "0"  # SpineBase not tracked
    file = write_csv(tmp_path / "states.csv", row, [["330000", *row[1:]]])
    (first, second) = camera_frames(import_recording(file, tmp_path / "out").raw_path)["camera_0"]
    assert (first.device_time_ns, second.device_time_ns) == (100_000, 33_000_000)
    assert np.isnan(first.positions[INDEX["hips"]]).all() and first.confidence[INDEX["hips"]] == 0
    np.testing.assert_allclose(first.positions[INDEX["head"]], [-0.5, -1, 3])
    assert first.confidence[INDEX["head"]] == 1
    for bad, code in ((["1"], "import.row_cut"), ([*row[:8], "7", *row[9:]], "import.kinect_state")):
        write_csv(file, row, [bad])
        with refused(FormatError, code, line=2):
            import_recording(file, tmp_path / "other")


def test_kinect_axes_turn_without_a_mirror() -> None:
    assert np.linalg.det(joint_set.R_CAMERA_KINECT) == pytest.approx(1.0)
    np.testing.assert_array_equal(joint_set.to_camera(np.array([1.0, 2.0, 3.0])), [-1, -2, 3])


@pytest.mark.parametrize("kind", ["camera-folders", "kinect-pair", "kinect-states"])
def test_every_importer_of_text_survives_any_bytes(tmp_path: Path, kind: str) -> None:
    rng = np.random.default_rng(5)
    good = {
        "camera-folders": ",".join(joints_header()) + "\n" + "\n".join(map(",".join, joints_rows(3))),
        "kinect-pair": ",".join(kinect_header())
        + "\n"
        + ",".join(kinect_rows(63_562_209_737_035, 9, 0, "k", 1.0)),
        "kinect-states": ",".join(["1000", *["0.5", "1", "3", "2"] * 25]),
    }[kind].encode()
    for k in range(60):
        data = bytearray(good)
        for _ in range(rng.integers(1, 6)):
            data[rng.integers(len(data))] = rng.integers(256)
        path = tmp_path / f"in{k}"
        file = path / "camera_0" / "joints.csv" if kind == "camera-folders" else path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(data)
        try:
            assert inspect_raw(import_recording(path, tmp_path / f"out{k}").raw_path).complete
        except StudioError:
            assert not (tmp_path / f"out{k}").exists()
