"""`studio robot`, and exports and figures of a robot, as a user calls them."""

import json
from pathlib import Path

import numpy as np
import pytest

from studio.__main__ import main
from studio.engine.animation.clip.resample import frames_of
from studio.engine.animation.read.imported import imported_poses
from studio.take.folder.take import POSES
from tests.engine.robots import models


@pytest.fixture
def take(tmp_path: Path, test_data: Path) -> Path:
    """A take of a quarter of a second of a walk."""
    clip = test_data / "mocap" / "02_03.bvh"
    folder = tmp_path / "take"
    assert main(["import", str(clip), "--out", str(folder)]) == 0
    frames_of(imported_poses(clip)[0], slice(1, 31)).save(folder / "solves" / "imported" / POSES)
    return folder


def test_a_robot_is_added_shown_and_follows_a_take(
    take: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    model = models.written(tmp_path, models.child())
    sessions = ["--sessions", str(tmp_path / "sessions")]
    assert main(["robot", "add", str(model), "--name", "child", "--velocity", "12", *sessions]) == 0
    assert main(["robot", "list", *sessions]) == 0
    assert main(["robot", "show", "child", "--json", str(tmp_path / "facts.json"), *sessions]) == 0
    told = capsys.readouterr().out
    assert "legs 0.440 m" in told
    assert "\nchild\n" in told
    assert json.loads((tmp_path / "facts.json").read_text())["moved"] == 25
    out = tmp_path / "motion.csv"
    of_robot = ["--robot", "child", "--format", "csv", "--fps", "60", "--out", str(out), *sessions]
    assert main(["export", str(take), *of_robot]) == 0
    rows = np.loadtxt(out, delimiter=",")
    assert rows.shape == (15, 7 + 25)
    assert np.allclose(np.linalg.norm(rows[:, 3:7], axis=1), 1.0, atol=1e-5)
    for wrong in (["--smooth-hz", "-1"], ["--fps", "0"]):
        assert main(["export", str(take), *of_robot, *wrong]) == 2
    assert (
        main(["robot", "play", "child", str(out), "--fps", "0", "--out", str(tmp_path / "x.png"), *sessions])
        == 2
    )
    assert "above 0" in capsys.readouterr().err
    figures = tmp_path / "figures.json"
    assert main(["evaluate", str(take), "--robot", "child", "--json", str(figures), *sessions]) == 0
    ways = json.loads(figures.read_text())["solves"]["imported"]
    assert set(ways) == {"whole take", "with balance", "live", "per frame"}
    assert ways["whole take"]["limit_share"] == ways["whole take"]["velocity_share"] == 0.0
    assert main(["robot", "remove", "child", *sessions]) == 0
    assert main(["robot", "show", "child", *sessions]) == 1
    assert "no robot 'child'" in capsys.readouterr().err


WRONG = [
    (["export", "{take}", "--robot", "child", "--format", "fbx", "--out", "x"], "csv"),
    (["export", "{take}", "--robot", "child", "--format", "csv", "--loop", "--out", "x"], "does not apply"),
    (["export", "{take}", "--balance", "--format", "csv", "--out", "x"], "--robot"),
    (["evaluate", "{take}"], "--robot NAME"),
    (["robot", "add", "m.xml", "--name", "x", "--part", "left_hand"], "PART=BODY"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "told"), WRONG)
def test_wrong_use_is_said_in_one_line(
    arguments, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    assert main([argument.format(take=tmp_path) for argument in arguments]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
