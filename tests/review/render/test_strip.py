"""Strips of frames as PNG."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from studio.engine.base.errors import FormatError
from studio.review.render import render_strip
from studio.review.render.__main__ import main
from studio.review.render.strip import default_times, stage_times
from tests.refused import refused
from tests.review.render.figures import sidestep


def test_a_strip_has_a_row_per_solve_and_a_column_per_time(tmp_path: Path) -> None:
    path = tmp_path / "strip.png"
    render_strip({"raw": sidestep(), "studio": sidestep()}, path, times_s=[0.0, 0.5, 0.9], cell=(100, 150))
    with Image.open(path) as picture:
        pixels = np.asarray(picture.convert("RGB")).astype(int)
    assert pixels.shape[1] > 3 * 100 and pixels.shape[0] > 2 * 150
    dark = pixels.sum(axis=2) < 600
    for row in range(2):
        for column in range(3):
            top, left = 14 + 22 + row * 172, 14 + column * 106
            assert dark[top : top + 150, left : left + 100].mean() > 0.02  # somebody stands there


def test_times_of_a_live_take_count_from_its_first_frame() -> None:
    poses = sidestep()
    live = replace(poses, time_s=poses.time_s + 1.7e9)
    since = np.array(default_times(live, 4)) - live.begins_s
    np.testing.assert_allclose(since, default_times(poses, 4), atol=1e-6)
    assert stage_times(live, [0.5]) == [live.begins_s + 0.5] and stage_times(poses, [0.5]) == [0.5]


def test_labels_count_from_the_beginning_of_the_performance(tmp_path: Path) -> None:
    poses = sidestep()
    later = replace(poses, time_s=poses.time_s + 34.0)
    pictures = []
    for name, one, times_s in (("now", poses, [0.0, 0.5]), ("later", later, [34.0, 34.5])):
        render_strip(one, tmp_path / f"{name}.png", times_s=times_s, cell=(100, 150))
        pictures.append((tmp_path / f"{name}.png").read_bytes())
    assert pictures[0] == pictures[1]


def test_no_frames_is_one_clear_error_and_no_file(tmp_path: Path) -> None:
    poses = sidestep(0)
    with refused(FormatError, "picture.no_frames"):
        render_strip(poses, tmp_path / "strip.png")
    with refused(FormatError, "picture.other_joints"):
        render_strip(
            replace(sidestep(), joint_names=tuple(f"j{i}" for i in range(52))), tmp_path / "strip.png"
        )
    assert list(tmp_path.iterdir()) == []


def test_command_names_rows_after_their_solve(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "studio").mkdir()
    sidestep().save(tmp_path / "studio" / "poses.npz")
    out = tmp_path / "out.png"
    assert main([str(tmp_path / "studio" / "poses.npz"), str(out), "--times", "0.2"]) == 0
    assert out.stat().st_size > 1000
    assert main([str(tmp_path / "nowhere.npz"), str(tmp_path / "b.png")]) == 1
    assert "no poses at" in capsys.readouterr().err
