"""What `studio calibrate` is told of lenses."""

import argparse
import json

import pytest

from studio.commands.takes.calibrate import add_parser
from studio.commands.takes.lenses import given_lenses, given_readouts
from studio.engine.base.errors import SettingsError
from studio.engine.calibration.views.seen.known_lens import KnownLens
from tests.refused import refused

CAMERAS = ("left", "right")


def given(*words: str) -> dict[str, KnownLens]:
    parser = argparse.ArgumentParser()
    add_parser(parser.add_subparsers())
    return given_lenses(parser.parse_args(["calibrate", "take", *words]), CAMERAS)


def test_what_names_a_camera_counts_before_the_rest():
    found = given("--focal-px", "left=900+-9", "--fov-deg", "90+-2")
    assert found["left"] == KnownLens(focal_px=900.0, share=0.01)
    assert found["right"].field_deg == 90 and found["right"].share == pytest.approx(0.0349, abs=1e-4)
    assert given("--same-lens") == {}


def test_readouts_are_those_of_all_or_of_one():
    assert given_readouts([], CAMERAS) == {}
    assert given_readouts(["right=30", "18.5"], CAMERAS) == {"left": 18.5, "right": 30.0}
    for wrong in ("left=fast", "-1", "nan", "200", "middle=20"):
        with pytest.raises(SettingsError):
            given_readouts([wrong], CAMERAS)


def test_a_file_gives_the_lenses_of_the_cameras_that_it_names(tmp_path):
    lens = {"fx": 900, "fy": 900, "cx": 320, "cy": 240, "width": 640, "height": 480}
    file = tmp_path / "calibration.json"
    file.write_text(json.dumps({"cameras": {"left": {"intrinsics": lens}, "other": {"intrinsics": lens}}}))
    assert given("--lens", str(file)).keys() == {"left"}
    file.write_text(json.dumps(lens))
    assert given("--lens", str(file)).keys() == {"left", "right"}
    assert given("--lens", f"right={file}").keys() == {"right"}
    file.write_text(json.dumps({"cameras": {"other": {"intrinsics": lens}}}))
    with refused(SettingsError, "value.bad"):
        given("--lens", str(file))
    with refused(SettingsError, "value.bad"):
        given("--fov-deg", "wide")
