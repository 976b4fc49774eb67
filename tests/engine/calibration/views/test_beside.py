"""Ordinary cameras placed by the skeleton of depth cameras, in front of a simulated walker."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from studio.engine.animation.motion.authored import stage_motion
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.views.beside import place_beside
from studio.engine.calibration.views.seen.view import View
from studio.engine.model.frames import CameraFrame, PictureJoints
from studio.engine.model.joints import JOINT_COUNT, to_canonical
from studio.simulator.joints.seen import see
from studio.simulator.landmarks.seen import SeenLandmarks, see_landmarks
from studio.simulator.rig import standard_rig

LASTS_S = 30.0
DEPTH_NOISE_M = 0.015


@cache
def walker() -> CanonicalMotion:
    motion = stage_motion()
    return replace(motion, positions_m=motion.positions_m[: round(LASTS_S / motion.frame_s)])


@pytest.fixture(scope="module")
def seen() -> list[SeenLandmarks]:
    return list(see_landmarks(walker(), standard_rig(2), seed=5))


def view_of(camera: SeenLandmarks) -> View:
    """The camera's landmarks; its clock begins at the first one."""
    used = [
        (t, picture) for t, picture in zip(camera.device_time_ns, camera.pictures, strict=True) if picture
    ]
    flat = [
        to_canonical("mediapipe", np.column_stack([picture.pixels, np.zeros(33)]), picture.visibility)
        for _, picture in used
    ]
    world = [to_canonical("mediapipe", picture.world_m, picture.visibility)[0] for _, picture in used]
    times = np.array([t for t, _ in used]) * 1e-9
    return View(
        camera.camera, times - times[0], np.array([joints[:, :2] for joints, _ in flat]),
        np.array([sure for _, sure in flat]), np.array(world), camera.lens.width, camera.lens.height,
    )  # fmt: skip


def joints_by_depth() -> tuple[np.ndarray, np.ndarray]:
    times = np.arange(1.0, LASTS_S - 1.0, 1.0 / 30.0)
    motion = walker()
    true = np.array([motion.at(float(t)) for t in times])
    return times, true + np.random.default_rng(2).normal(0.0, DEPTH_NOISE_M, true.shape)


@pytest.mark.parametrize("index", [0, 1])
def test_a_camera_is_placed_with_its_lens_and_clock(seen: list[SeenLandmarks], index: int) -> None:
    camera, rig = seen[index], standard_rig(2)[index]
    ahead_s = float(camera.taken_s[0])
    placed = place_beside(view_of(camera), *joints_by_depth(), near_s=ahead_s + 0.6)
    off = np.linalg.inv(rig.T_stage_camera) @ placed.T_stage_camera
    assert np.degrees(np.arccos((np.trace(off[:3, :3]) - 1.0) / 2.0)) < 0.5
    assert np.linalg.norm(off[:3, 3]) < 0.06
    assert placed.lens.fx == pytest.approx(camera.lens.fx, rel=0.03)
    assert placed.ahead_s == pytest.approx(ahead_s, abs=0.008)
    assert placed.verdict != "refused", placed.reasons
    assert placed.uncertain.place_m < 0.05 and placed.rests.median_mrad < 12


def test_another_performer_is_refused(seen: list[SeenLandmarks]) -> None:
    times, joints = joints_by_depth()
    placed = place_beside(view_of(seen[0]), times, joints[::-1].copy())
    assert placed.verdict == "refused" and placed.reasons


def test_nobody_together_is_refused(seen: list[SeenLandmarks]) -> None:
    times, joints = joints_by_depth()
    placed = place_beside(view_of(seen[0]), times + 100.0, joints)
    assert placed.verdict == "refused" and [reason.code for reason in placed.reasons] == [
        "views.nothing_beside"
    ]


def test_both_kinds_of_cameras_are_calibrated_on_one_stage(seen: list[SeenLandmarks]) -> None:
    deep = next(iter(see(walker(), standard_rig(2), seed=5)))
    flat = seen[1]
    frames = {
        "deep": [
            CameraFrame("deep", k, int(stamp), deep.positions_m[k], deep.confidence[k])
            for k, stamp in enumerate(deep.device_time_ns)
        ],
        "flat": frames_of("flat", flat),
    }
    result = calibrate(frames)
    assert result.reference == "deep" and not result.refused, result.reasons()
    lens = result.cameras["flat"].lens
    assert lens is not None and lens.fx == pytest.approx(flat.lens.fx, rel=0.05)
    wanted = [rig.T_stage_camera for rig in standard_rig(2)]
    between = np.linalg.inv(wanted[0]) @ wanted[1]
    found = np.linalg.inv(result.cameras["deep"].T_stage_camera) @ result.cameras["flat"].T_stage_camera
    off = np.linalg.inv(between) @ found
    assert np.degrees(np.arccos((np.trace(off[:3, :3]) - 1.0) / 2.0)) < 1.5
    assert np.linalg.norm(off[:3, 3]) < 0.12
    late_s = 1e-9 * result.cameras["flat"].clock.stage_ns(int(flat.device_time_ns[50])) - flat.taken_s[50]
    assert abs(late_s) < 0.015


def frames_of(name: str, camera: SeenLandmarks) -> list[CameraFrame]:
    view = view_of(camera)
    used = [k for k, picture in enumerate(camera.pictures) if picture is not None]
    unseen = np.full((JOINT_COUNT, 3), np.nan)
    return [
        CameraFrame(
            name, k, int(camera.device_time_ns[k]), unseen, view.confidence[row],
            picture=PictureJoints(view.width, view.height, view.pixels[row], view.world_m[row]),
        )
        for row, k in enumerate(used)
    ]  # fmt: skip
