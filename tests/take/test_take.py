"""take.json, calibrations, solves, names, and takes that are made in one piece."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studio import wire
from studio.engine.base.errors import CalibrationError, TakeError
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.take.folder.lock import is_held
from studio.take.folder.names import check_name, inside, is_safe_name
from studio.take.folder.new import new_take
from studio.take.folder.take import Take, TakeVersionError
from tests.refused import refused
from tests.take.helpers import hello

HOSTILE = [
    "",
    ".",
    "..",
    "../x",
    "a/b",
    "/etc",
    "a\\b",
    "C:x",
    "x\0y",
    "a\nb",
    ".hidden",
    " x",
    "x ",
    "x.",
    "y" * 64,
    "a*",
]


def calibration(verdict: str = "good") -> Calibration:
    T = np.eye(4)
    T[:3, 3] = [0.125, 0.25, 3.0]
    return Calibration("camera_0", {"camera_0": CameraCalibration(T, verdict=verdict)})


def test_a_new_take_opens_again_as_it_was(tmp_path: Path) -> None:
    take = Take.create(tmp_path / "t", session="day 1", name="take_001", source="live", performer="Ada")
    camera = wire.Hello(
        1,
        "camera_0",
        "Kinect v2",
        "kinect-v2",
        "b1",
        serial="7",
        intrinsics=wire.Intrinsics(1, 2, 3, 4, 5, 6),
    )
    take.add_camera(camera)
    take.add_camera(hello("camera_0", boot_id="b2"))
    take.add_camera(hello("camera_1"))
    take.save_meta()
    meta = Take.open(tmp_path / "t").meta
    assert meta == take.meta
    assert meta["format_version"] == 1 and meta["id"] == "day 1/take_001" and meta["performer"] == "Ada"
    assert meta["recording"] == "recording" and meta["calibration"] is None and meta["rating"] is None
    assert meta["created"].endswith("+00:00") and meta["notes"] == ""
    assert take.camera_names == ("camera_0", "camera_1")
    assert meta["cameras"][0]["boot_ids"] == ["b1", "b2"] and meta["cameras"][0]["intrinsics"]["height"] == 6


def test_a_take_never_overwrites(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    Take.create(tmp_path / "empty", session="s", name="t", source="live")
    with refused(TakeError, "take.not_empty"):
        Take.create(tmp_path / "empty", session="s", name="t", source="live")
    (tmp_path / "file").write_text("x")
    with refused(TakeError, "take.not_empty"):
        Take.create(tmp_path / "file", session="s", name="t", source="live")
    with refused(TakeError, "take.source", allowed=["live", "import", "simulate", "splice"]):
        Take.create(tmp_path / "other", session="s", name="t", source="film")
    with refused(TakeError, "take.not_made"):
        Take.create(tmp_path / "file" / "t", session="s", name="t", source="live")


def test_what_is_no_take_is_told(tmp_path: Path) -> None:
    with refused(TakeError, "take.no_folder"):
        Take.open(tmp_path / "missing")
    with refused(TakeError, "take.no_take_json"):
        Take.open(tmp_path)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "take.json_unreadable"),
        ("\xff{", "take.json_unreadable"),
        ("[]", "take.json_other"),
        ("{}", "take.json_other"),
        ('{"format_version": 1}', "take.fields"),
        ("[" * 100_000, "take.json_unreadable"),
    ],
)
def test_a_broken_take_json_is_told(tmp_path: Path, text: str, code: str) -> None:
    (tmp_path / "take.json").write_text(text, encoding="latin-1")
    with refused(TakeError, code):
        Take.open(tmp_path)


def test_another_version_has_its_own_error(tmp_path: Path) -> None:
    take = Take.create(tmp_path / "t", session="s", name="t", source="live")
    take.meta["format_version"] = 2
    take.save_meta()
    with refused(TakeVersionError, "take.version", own=1):
        Take.open(tmp_path / "t")


def test_a_take_whose_only_calibration_was_refused_says_so(tmp_path: Path) -> None:
    take = Take.create(tmp_path / "t", session="s", name="t", source="live")
    take.add_calibration(calibration("refused"), use=False)
    with refused(CalibrationError, "take.calibration_refused", number=1):
        take.calibration()


def test_calibrations_are_numbered_and_kept(tmp_path: Path) -> None:
    take = Take.create(tmp_path / "t", session="s", name="t", source="live")
    with refused(CalibrationError, "take.not_calibrated"):
        take.calibration()
    assert take.add_calibration(calibration(), use=True) == 1
    assert take.add_calibration(calibration("refused"), use=False) == 2
    again = Take.open(tmp_path / "t")
    np.testing.assert_array_equal(
        again.calibration().cameras["camera_0"].T_stage_camera,
        calibration().cameras["camera_0"].T_stage_camera,
    )
    assert again.meta["calibration"] == 1 and again.calibration_numbers() == [1, 2]
    again.calibration_path(1).write_text("{")
    with refused(CalibrationError, "take.calibration_unreadable"):
        again.calibration()


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_are_refused(tmp_path: Path, name: str) -> None:
    assert not is_safe_name(name)
    take = Take.create(tmp_path / "t", session="s", name="t", source="live")
    for attempt in (
        lambda: take.solve_folder(name),
        lambda: Take.create(tmp_path / "u", session=name, name="t", source="live"),
        lambda: Take.create(tmp_path / "u", session="s", name=name, source="live"),
    ):
        with refused(TakeError, "name.not_allowed"):
            attempt()
    assert not (tmp_path / "u").exists()


@given(st.text(max_size=70))
def test_a_safe_name_stays_inside(name: str) -> None:
    if is_safe_name(name):
        assert inside(Path("/srv/sessions"), check_name("take", name)).parent == Path("/srv/sessions")


def test_a_link_does_not_lead_out(tmp_path: Path) -> None:
    take = Take.create(tmp_path / "t", session="s", name="t", source="live")
    (take.path / "solves" / "studio").symlink_to(tmp_path)
    with refused(TakeError, "name.leads_out"):
        take.solve_folder("studio")


def test_solves_are_those_with_poses(tmp_path: Path) -> None:
    take = Take.create(tmp_path / "t", session="s", name="t", source="live")
    for name in ("studio", "raw", "unfinished"):
        take.solve_folder(name).mkdir()
    for name in ("studio", "raw"):
        (take.solve_folder(name) / "poses.npz").write_bytes(b"")
    assert take.solve_names() == ["raw", "studio"]


def test_a_new_take_is_there_whole(tmp_path: Path) -> None:
    with new_take(tmp_path / "day" / "take_007", source="simulate", calibration_s=34.0) as take:
        assert not (tmp_path / "day" / "take_007").exists()
        assert is_held(take.path)
        (take.path / "raw.mcap").write_bytes(b"x")
    assert take.path == tmp_path / "day" / "take_007"
    meta = json.loads((tmp_path / "day" / "take_007" / "take.json").read_text())
    assert (meta["session"], meta["name"], meta["recording"]) == ("day", "take_007", "done")
    assert [f.name for f in (tmp_path / "day").iterdir()] == ["take_007"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_new_take_that_fails_leaves_nothing(tmp_path: Path, error: type[BaseException]) -> None:
    with pytest.raises(error), new_take(tmp_path / "a" / "b" / "t", source="import") as take:
        (take.path / "raw.mcap").write_bytes(b"x")
        raise error
    assert list(tmp_path.iterdir()) == []


def test_a_new_take_does_not_replace_what_appeared_meanwhile(tmp_path: Path) -> None:
    with refused(TakeError, "take.not_finished"), new_take(tmp_path / "t", source="import"):
        (tmp_path / "t").mkdir()
        (tmp_path / "t" / "mine").write_text("x")
    assert [f.name for f in tmp_path.iterdir()] == ["t"]
    with refused(TakeError, "take.not_empty"), new_take(tmp_path / "t", source="import"):
        pass
