"""A robot in place of the performers: chosen for all browsers, computed once for a solve, shown at its frames."""

from pathlib import Path

import httpx
import numpy as np
import pytest
from fastapi import FastAPI

from studio.engine.animation.clip.resample import frames_of
from studio.engine.animation.read.imported import imported_poses
from studio.engine.model.poses import on_output_joints
from studio.engine.model.settings.settings import preset
from studio.engine.robots.files import FOLDER, add_robot, load_robot
from studio.offline.robots import keep_robot_motions, kept_robot_motions
from studio.take.folder.solves import write_solve
from studio.take.folder.take import Take
from studio.web import ViewHandle
from tests.engine.robots import models
from tests.web.playback.takes import take_with_solves
from tests.web.stages import until


@pytest.fixture
def walk(tmp_path: Path, test_data: Path) -> Take:
    """A take of a quarter of a second of a walk, and a kept robot."""
    add_robot(tmp_path / FOLDER, models.written(tmp_path, models.child()), "child")
    take = take_with_solves(tmp_path / "monday" / "walk")
    poses = frames_of(imported_poses(test_data / "mocap" / "02_03.bvh")[0], slice(1, 31))
    write_solve(
        take, "walk", settings=preset("studio"), poses=on_output_joints(poses), metrics={}, trace=None
    )
    return take


def test_a_chosen_robot_is_computed_once_and_shown(
    handle: tuple[ViewHandle, FastAPI], address: str, walk: Take, tmp_path: Path, monkeypatch
) -> None:
    shown = []
    monkeypatch.setattr(handle[0].view, "show_replay", lambda *given: shown.append(given))
    with httpx.Client(base_url=f"{address}/api/v1", timeout=60.0) as client:
        assert client.get("/view").json()["robots"] == ["child"]
        assert client.put("/replay", json={"take": "monday/walk", "solve": "walk"}).status_code == 200
        state = client.put("/view", json={"robot": "child"}).json()
        assert state["robot"] == "child"
        assert handle[0].view.robot is not None
        until(lambda: shown[-1][-1][0] == "child")
        client.patch("/replay", json={"frame": 20})
        motions = kept_robot_motions(walk, "walk", tmp_path / FOLDER, handle[0].view.robot.robot)
        assert motions is not None
        until(lambda: np.array_equal(shown[-1][-1][1][1], motions[1].motion.qpos[20]))
        assert "no robot" in client.put("/view", json={"robot": "nobody"}).text
        assert client.put("/view", json={"robot": ""}).json()["robot"] == ""
        until(lambda: shown[-1][-1] == ("", {}))


def test_what_is_too_much_for_a_robot_is_told(
    handle: tuple[ViewHandle, FastAPI], address: str, walk: Take, tmp_path: Path
) -> None:
    """Robots with weak knees walk. The view's state has which joints are beyond their limits, when, and how far; or
    when a robot gave way, so that they are not."""
    knees = ("l_k_pitch0", "r_k_pitch0")
    with httpx.Client(base_url=f"{address}/api/v1", timeout=60.0) as client:
        client.put("/replay", json={"take": "monday/walk", "solve": "walk"})
        for name, limit_nm in (("weak", 0.001), ("tired", 0.4)):
            limits = f'ctrlrange="-{limit_nm} {limit_nm}"'
            motors = "".join(f'<motor joint="{knee}" {limits}/>' for knee in knees)
            whole = models.child().replace("</mujoco>", f"<actuator>{motors}</actuator></mujoco>")
            add_robot(tmp_path / FOLDER, models.written(tmp_path, whole, f"{name}.xml"), name)
            keep_robot_motions(walk, "walk", tmp_path / FOLDER, name)
        state = client.put("/view", json={"robot": "weak"}).json()
        told = state["robot_strained"]
        assert {(one["performer"], one["joint"]) for one in told} == {(1, knee) for knee in knees}
        for one in told:
            assert one["most"] > 1.0 and 0.0 < one["frame_share"] <= 1.0 and 0.0 < one["at_s"] < 0.25
        times = client.put("/view", json={"robot": "tired"}).json()["robot_gave_way"]
        assert times
        for one in times:
            assert (
                one["performer"] == 1 and 0.0 <= one["begin_s"] <= one["end_s"] < 0.25 and one["most_m"] > 0.0
            )
        assert client.put("/view", json={"robot": ""}).json()["robot_strained"] == []


def test_a_motion_is_made_again_for_other_poses_and_by_other_code(
    walk: Take, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, robot = tmp_path / FOLDER, load_robot(tmp_path / FOLDER, "child")
    keep_robot_motions(walk, "walk", folder, "child")
    assert kept_robot_motions(walk, "walk", folder, robot) is not None
    with monkeypatch.context() as other:
        other.setattr("studio.offline.robots.code_digest", lambda *folders: "another")
        assert kept_robot_motions(walk, "walk", folder, robot) is None
    file = walk.solve_folder("walk") / "poses.npz"
    file.write_bytes((walk.solve_folder("studio") / "poses.npz").read_bytes())
    assert kept_robot_motions(walk, "walk", folder, robot) is None
