"""The stage's calibrations on disk: numbered, never overwritten, broken ones passed over."""

from dataclasses import replace

from studio.live.calibrations import load_last_calibration, save_calibration
from tests.live.performer import calibration


def test_each_calibration_gets_its_own_number(tmp_path):
    assert load_last_calibration(tmp_path / "none") is None
    assert [save_calibration(tmp_path, calibration(["a"])) for _ in range(3)] == [1, 2, 3]
    number, last = load_last_calibration(tmp_path)
    assert number == 3 and list(last.cameras) == ["a"]


def test_what_cannot_be_used_is_passed_over(tmp_path):
    good = calibration(["a", "b"])
    save_calibration(tmp_path, good)
    save_calibration(tmp_path, replace(good, performer=None))
    refused = replace(good.cameras["b"], verdict="refused")
    save_calibration(tmp_path, replace(good, cameras=good.cameras | {"b": refused}))
    (tmp_path / "4.json").write_text("{")
    (tmp_path / "5.json").write_text("[]")
    number, _ = load_last_calibration(tmp_path)
    assert number == 1
    assert save_calibration(tmp_path, good) == 6
