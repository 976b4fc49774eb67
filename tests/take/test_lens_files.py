"""Lenses are read from the files of the studio, OpenCV, Pose2Sim and FreeMoCap."""

import json

import pytest

from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.calibration.views.seen.known_lens import KnownLens
from studio.engine.model.cameras.lens import Lens
from studio.take.folder.lens_files import lens_for, read_lenses
from tests.refused import refused

LENS = Lens(1500.0, 1510.0, 540.0, 950.0, 1080, 1920, (0.1, -0.2, 0.0, 0.0))
OWN = {
    "fx": 1500, "fy": 1510, "cx": 540, "cy": 950, "width": 1080, "height": 1920, "distortion": [0.1, -0.2, 0, 0],
}  # fmt: skip
MATRIX = [[1500, 0, 540], [0, 1510, 950], [0, 0, 1]]
FLAT = [*MATRIX[0], *MATRIX[1], *MATRIX[2]]
TOML = """[{table}]
name = "{name}"
size = [ 1080.0, 1920.0,]
matrix = [ [ 1500.0, 0.0, 540.0,], [ 0.0, 1510.0, 950.0,], [ 0.0, 0.0, 1.0,],]
distortions = [ 0.1, -0.2, 0.0, 0.0,]
rotation = [ 1.2, -0.5, 0.4,]
translation = [ -0.1, 0.8, 4.8,]
fisheye = false

"""


@pytest.mark.parametrize(
    ("name", "text", "camera"),
    [
        ("a.json", json.dumps(OWN), ""),
        ("a.json", json.dumps({"intrinsics": OWN}), ""),
        ("a.json", json.dumps({"cameras": {"left": {"intrinsics": OWN}, "depth": {"intrinsics": None}}}), "left"),
        (
            "a.json",
            json.dumps({"camera_matrix": MATRIX, "image_size": [1080, 1920], "dist_coeffs": [[0.1, -0.2, 0, 0]]}),
            "",
        ),
        (
            "a.json",
            json.dumps(
                {
                    "image_width": 1080, "image_height": 1920, "camera_matrix": {"rows": 3, "data": FLAT},
                    "distortion_coefficients": {"data": [0.1, -0.2, 0, 0]},
                }
            ),
            "",
        ),
        ("Calib.toml", TOML.format(table="cam_0", name="left") + "[metadata]\nadjusted = false\n", "left"),
    ],
)  # fmt: skip
def test_lenses_of_all_forms(tmp_path, name, text, camera):
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    assert read_lenses(file) == {camera: LENS} and lens_for("any", file) == LENS


def test_of_several_lenses_that_of_the_camera_is_taken(tmp_path):
    file = tmp_path / "Calib.toml"
    text = TOML.format(table="cam_0", name="left") + TOML.format(table="cam_1", name="right").replace(
        "1500", "1400"
    )
    file.write_text(text, encoding="utf-8")
    assert lens_for("right", file).fx == 1400 and lens_for("left", file) == LENS
    with refused(FormatError, "calibration.lens_of_other"):
        lens_for("middle", file)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"fx": 1}', json.dumps({**OWN, "fx": -1}), "{" * 9])
def test_what_is_no_lens_is_said(tmp_path, text):
    file = tmp_path / "a.json"
    file.write_text(text, encoding="utf-8")
    with refused(FormatError, "calibration.lens_file"):
        read_lenses(file)
    with refused(FormatError, "calibration.lens_file"):
        read_lenses(tmp_path / "none.toml")


def test_a_lens_fits_its_pictures():
    assert KnownLens(LENS).of("left", 540, 960).fx == 750
    with refused(SettingsError, "views.lens_shape"):
        KnownLens(LENS).of("left", 1920, 1080)
    focal = KnownLens(focal_px=900.0).of("left", 640, 480)
    assert (focal.fx, focal.fy, focal.cx, focal.cy) == (900, 900, 319.5, 239.5)
    assert KnownLens(field_deg=90.0).of("left", 480, 640).fx == pytest.approx(320)
    for focal_px, field_deg, share in ((0.0, None, 0.0), (None, 200.0, 0.0), (900.0, None, 0.9)):
        with refused(SettingsError, "value.bad"):
            KnownLens(focal_px=focal_px, field_deg=field_deg, share=share)
