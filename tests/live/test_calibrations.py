"""The stage's calibrations on disk: numbered, never overwritten; damaged ones are skipped."""

from dataclasses import replace

from studio.live.calibration.kept import load_last_calibration, save_calibration
from tests.live.performer import calibration


def test_each_calibration_gets_its_own_number(tmp_path):
    assert load_last_calibration(tmp_path / "none") is None
    kept = [save_calibration(tmp_path, calibration(["a"]), {"a": "serial"}) for _ in range(3)]
    assert [one.number for one in kept] == [1, 2, 3]
    last = load_last_calibration(tmp_path)
    assert last.number == 3 and list(last.calibration.cameras) == ["a"]
    assert (last.created, last.devices) == (kept[2].created, {"a": "serial"})


def test_what_cannot_be_used_is_passed_over(tmp_path):
    good = calibration(["a", "b"])
    save_calibration(tmp_path, good, None)
    save_calibration(tmp_path, replace(good, performer=None), None)
    refused = replace(good.cameras["b"], verdict="refused")
    save_calibration(tmp_path, replace(good, cameras=good.cameras | {"b": refused}), None)
    (tmp_path / "4.json").write_text("{")
    (tmp_path / "5.json").write_text("[]")
    assert load_last_calibration(tmp_path).number == 1
    assert save_calibration(tmp_path, good, None).number == 6
