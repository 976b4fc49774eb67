"""Robots that a browser sent: kept with their files, named after their models, and refused where they lead out."""

import shutil
from pathlib import Path

import pytest

from studio.engine.base.errors import FormatError
from studio.engine.robots.files import (
    FOLDER,
    correct_robot,
    kept_robots,
    load_robot,
    remove_robot,
    restore_robot,
)
from studio.take.library.incoming_robot import import_robots
from tests.engine.robots import models
from tests.refused import refused


@pytest.fixture
def came(tmp_path: Path) -> Path:
    """A folder of what came: two models, a scene around one of them, and a model of what is no humanoid."""
    folder = tmp_path / ".import-1"
    robot = folder / "robot"
    robot.mkdir(parents=True)
    models.written(robot, models.child(), "child.xml")
    models.written(robot, models.child(), "other one.xml")
    models.written(robot, '<mujoco><include file="child.xml"/><worldbody/></mujoco>', "scene.xml")
    models.written(robot, models.humanoid(feet=False), "stool.xml")
    return folder


def test_robots_are_kept_with_their_files_and_named_after_their_models(came: Path, tmp_path: Path):
    robots = tmp_path / FOLDER
    again = shutil.copytree(came, tmp_path / ".import-2")
    assert import_robots(came, "robot", "robot", robots) == ["child", "other_one"]
    assert import_robots(again, "robot", "robot", robots) == ["child_2", "other_one_2"]
    moved = tmp_path / "elsewhere"
    robots.rename(moved)
    assert load_robot(moved, "child_2").name == "child_2"
    corrected = correct_robot(moved, "child", {"head": "l_s_yaw1"}, 3.0)
    assert corrected.parts["head"] == "l_s_yaw1" and set(load_robot(moved, "child").velocity_rad_s) == {3.0}
    remove_robot(moved, "child")
    assert "child" not in kept_robots(moved)
    restore_robot(moved, "child")
    assert load_robot(moved, "child").parts["head"] == "l_s_yaw1"
    with refused(FormatError, "robot.not_removed", name="child"):
        restore_robot(moved, "child")


@pytest.mark.parametrize(
    "named",
    [
        '<include file="../../secret.xml"/>',
        '<compiler meshdir="/etc"/><asset><mesh name="a" file="passwd"/></asset>',
        '<compiler meshdir="../.."/><asset><texture name="a" file="a.png" type="2d"/></asset>',
    ],
)
def test_a_model_that_names_files_outside_of_its_folder_is_refused(came: Path, tmp_path: Path, named: str):
    text = models.child().replace("<worldbody>", f"{named}<worldbody>", 1)
    models.written(came / "robot", text, "child.xml")
    (tmp_path / "secret.xml").write_text("<mujoco/>")
    with refused(FormatError, "robot.file_outside"):
        import_robots(came, "robot", "robot", tmp_path / FOLDER)
    assert not (tmp_path / FOLDER).exists()


def test_what_is_no_robot_leaves_nothing(came: Path, tmp_path: Path):
    for name in ("child.xml", "other one.xml", "scene.xml"):
        (came / "robot" / name).unlink()
    with refused(FormatError, "robot.not_humanoid", path="stool.xml"):
        import_robots(came, "robot", "robot", tmp_path / FOLDER)
    assert list((tmp_path / FOLDER / "models").iterdir()) == []
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / "notes.xml").write_text("<notes>")
    with refused(FormatError, "robot.no_model", name="empty"):
        import_robots(tmp_path / "empty", "", "empty", tmp_path / FOLDER)
