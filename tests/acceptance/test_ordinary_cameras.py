"""A stage of ordinary cameras, started as a user starts it: calibrated by the walk, recorded and solved live."""

from pathlib import Path

import numpy as np
import pytest

from studio.engine.model.poses import Poses
from studio.take.folder.take import Take
from tests.acceptance.processes import wait_until
from tests.acceptance.program import studio_program
from tests.patient import Client

LEAST_S = 3.0
ENOUGH = 540
"""Frames of each camera with which an operator ends the walk: 18 s."""


def test_ordinary_cameras_are_calibrated_by_the_walk_and_solved_live(tmp_path: Path) -> None:
    shoot(tmp_path, whole_walk=False)


@pytest.mark.long
def test_ordinary_cameras_are_calibrated_by_the_whole_walk_and_solved_live(tmp_path: Path) -> None:
    shoot(tmp_path, whole_walk=True)


def shoot(tmp_path: Path, *, whole_walk: bool) -> None:
    sessions = tmp_path / "sessions"
    with (
        studio_program(sessions, ("serve", "--cameras", "rgb")) as host,
        Client(base_url=f"http://{host}/api/v1") as api,
    ):
        if not whole_walk:
            wait_until(lambda: gathered(api) >= ENOUGH, "three ordinary cameras have seen enough of the walk")
            api.post("/calibration/finish").raise_for_status()
        wait_until(lambda: calibrated(api), "three ordinary cameras are calibrated")
        started = api.post("/record/start", json={}).raise_for_status().json()
        wait_until(
            lambda: (api.get("/status").json()["recording"] or {}).get("seconds", 0.0) > LEAST_S,
            "some seconds are recorded",
        )
        api.post("/record/stop").raise_for_status()
    take = Take.open(sessions / started["session"] / started["take"])
    cameras = take.calibration().cameras
    assert len(cameras) == 3 and all(camera.lens is not None for camera in cameras.values())
    poses = Poses.load(take.path / "solves" / "live" / "poses.npz")
    assert poses.time_s[-1] - poses.time_s[0] > 0.6 * LEAST_S
    height = np.ptp(poses.positions_m[:, :, 2], axis=1)
    assert 1.2 < np.median(height) < 2.3  # the performer may reach up


def gathered(api: Client) -> int:
    """How many frames the camera with the fewest has so far; 0 while one has none."""
    frames = api.get("/status").json()["calibration"]["attempt"]["frames"]
    return min(frames.values()) if len(frames) == 3 else 0


def calibrated(api: Client) -> bool:
    found = api.get("/status").json()["calibration"]
    assert found["attempt"]["state"] != "failed", found["attempt"]
    return found["state"] == "good" and len(found["cameras"]) == 3
