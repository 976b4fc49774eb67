"""A recording that plays as cameras brings its calibration, for as long as it plays."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import ClockModel
from studio.live import LiveStage
from studio.live.borrowed import brings_calibration, calibration_of_recording
from studio.live.calibration.performers import save_profile
from tests.live.performer import calibration, save_stage_calibration
from tests.web.playback.takes import take_with_solves

NAMES = ("camera_0", "camera_1")


def clocked() -> Calibration:
    """A calibration whose cameras were 50 ms apart, on a stage clock an hour off theirs."""
    made, hour_ns = calibration(list(NAMES)), 3_600_000_000_000
    clocks = {"camera_0": ClockModel(hour_ns), "camera_1": ClockModel(hour_ns + 50_000_000, 40.0, 5)}
    return replace(
        made, cameras={name: replace(camera, clock=clocks[name]) for name, camera in made.cameras.items()}
    )


def test_a_take_brings_the_calibration_in_use(tmp_path: Path) -> None:
    take = take_with_solves(tmp_path / "monday" / "one")
    assert calibration_of_recording(take.path, NAMES) is None
    take.add_calibration(clocked(), use=True)
    found = calibration_of_recording(take.path, NAMES)
    assert found is not None and found.performer is not None
    assert {name: camera.clock for name, camera in found.cameras.items()} == {
        "camera_0": ClockModel(0),
        "camera_1": ClockModel(50_000_000),
    }
    assert calibration_of_recording(take.path, (*NAMES, "camera_2")) is None  # which nobody has calibrated


def test_a_folder_brings_its_file_where_it_knows_a_performer(tmp_path: Path) -> None:
    assert calibration_of_recording(tmp_path, NAMES) is None
    file = tmp_path / "calibration.json"
    file.write_text(json.dumps(calibration(list(NAMES)).to_json()))
    assert calibration_of_recording(tmp_path, NAMES) is not None
    file.write_text(json.dumps(replace(calibration(list(NAMES)), performer=None).to_json()))
    assert calibration_of_recording(tmp_path, NAMES) is None
    file.write_text("{}")
    assert calibration_of_recording(tmp_path, NAMES) is None


def test_a_list_opens_a_calibration_once_until_it_changes(tmp_path: Path, monkeypatch) -> None:
    take = take_with_solves(tmp_path / "monday" / "one")
    read: list[Path] = []
    monkeypatch.setattr(
        "studio.live.borrowed.calibration_of_recording",
        lambda path, cameras: (read.append(path), calibration_of_recording(path, cameras))[1],
    )
    assert not brings_calibration(take.path, NAMES) and not brings_calibration(take.path, NAMES)
    take.add_calibration(clocked(), use=True)
    assert brings_calibration(take.path, NAMES) and brings_calibration(take.path, NAMES)
    assert len(read) == 2


@pytest.mark.parametrize("own", [True, False])
def test_it_is_used_for_a_while_and_kept_nowhere(tmp_path: Path, own: bool) -> None:
    if own:
        save_stage_calibration(tmp_path, ["camera_9"])
    stage = LiveStage(tmp_path)
    stage.start()
    try:
        before = stage.status().calibration
        stage.borrow_calibration(calibration(list(NAMES)))
        told = stage.status().calibration
        assert told.borrowed and told.state == "good" and set(told.cameras) == set(NAMES)
        save_profile(tmp_path, "Ada", calibration(["camera_0"]).performer)
        stage.use_performer("Ada")
        assert len(list((tmp_path / "calibrations").glob("*.json"))) == (1 if own else 0)
        stage.borrow_calibration(None)
        after = stage.status().calibration
        assert not after.borrowed and after.state == before.state == ("good" if own else "none")
        assert set(after.cameras) == ({"camera_9"} if own else set())
        stage.borrow_calibration(None)  # nothing is borrowed
        assert stage.status().calibration.state == before.state
    finally:
        stage.close()
