"""Simulated ordinary cameras: landmarks with a pose network's errors, and takes of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.camera.simulated.landmarks import SimulatedRgbConfig
from studio.camera.sources.registry import parse_source
from studio.engine.animation.motion.authored import stage_motion
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.base.geometry import invert_transform
from studio.engine.model.joints import INDEX, JOINT_SETS, to_canonical
from studio.simulator.landmarks.body import landmarks_of
from studio.simulator.landmarks.seen import SeenLandmarks, see_landmarks
from studio.simulator.rig import RigCamera, standard_rig
from studio.simulator.simulate import simulate_take
from studio.take.folder.take import Take
from studio.take.raw.frames import camera_frames
from tests.simulator.short_demo import short_demo

NAMES = JOINT_SETS["mediapipe"]


def beginning(seconds: float) -> CanonicalMotion:
    motion = stage_motion()
    kept = round(seconds / motion.duration_s * motion.frame_count)
    return replace(motion, positions_m=motion.positions_m[:kept])


@pytest.fixture(scope="module")
def seen() -> list[SeenLandmarks]:
    return list(see_landmarks(beginning(15.0), standard_rig(2), seed=4))


def missed_m(camera: SeenLandmarks, rig: RigCamera) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the landmarks across their rays [m], and their visibility, both (F, 33)."""
    motion = stage_motion()
    errors, visible = [], []
    for time_s, picture in zip(camera.taken_s[::5], camera.pictures[::5], strict=True):
        if picture is None:
            continue
        true = landmarks_of(motion.at(float(time_s))[None], motion.offsets_m, np.zeros((33, 3)))[0]
        T = invert_transform(rig.T_stage_camera)
        local = true @ T[:3, :3].T + T[:3, 3]
        off = np.linalg.norm(picture.pixels - camera.lens.pixels_of(local), axis=1)
        errors.append(off / camera.lens.fx * local[:, 2])
        visible.append(picture.visibility)
    return np.array(errors), np.array(visible)


def test_the_same_seed_gives_the_same_frames() -> None:
    seen, again = (list(see_landmarks(beginning(5.0), standard_rig(2), seed=4)) for _ in range(2))
    assert len(seen[1].pictures) > 100
    assert [one.lens for one in again] == [one.lens for one in seen]
    for ours, theirs in zip(seen[1].pictures, again[1].pictures, strict=True):
        assert (ours is None) == (theirs is None)
        assert ours is None or theirs is None or np.array_equal(ours.pixels, theirs.pixels, equal_nan=True)


def test_errors_are_a_networks(seen: list[SeenLandmarks]) -> None:
    found = [missed_m(camera, rig) for camera, rig in zip(seen, standard_rig(2), strict=True)]
    errors, visible = (np.concatenate(parts) for parts in zip(*found, strict=True))
    body = [NAMES.index(f"left_{name}") for name in ("shoulder", "elbow", "wrist", "knee", "ankle")]
    sure = visible[:, body] > 0.8
    assert 0.008 < np.median(errors[:, body][sure]) < 0.025  # BlazePose: 3 to 4 mrad at 3.4 m
    assert np.median(errors[:, body][~sure]) > 1.5 * np.median(errors[:, body][sure])


def test_left_and_right_are_exchanged_now_and_then(seen: list[SeenLandmarks]) -> None:
    camera = seen[0]
    left, right = (NAMES.index(f"{side}_shoulder") for side in ("left", "right"))
    found = [picture.pixels for picture in camera.pictures if picture is not None]
    order = np.array([pixels[left, 0] > pixels[right, 0] for pixels in found])
    assert 4 < np.abs(np.diff(order.astype(int))).sum() < 0.2 * len(order)


def test_the_guess_is_about_the_hips_and_of_a_usual_size(seen: list[SeenLandmarks]) -> None:
    picture = next(picture for picture in seen[0].pictures if picture is not None)
    world, _ = to_canonical("mediapipe", picture.world_m, np.ones(33))
    assert np.linalg.norm(world[INDEX["hips"]]) < 0.1
    assert (
        1.2 < np.ptp(world[np.isfinite(world[:, 1]), 1]) < 1.9
        and world[INDEX["head"], 1] < world[INDEX["hips"], 1]
    )


def test_a_take_holds_the_landmarks(tmp_path: Path) -> None:
    with short_demo(3.0):
        simulate_take("demo", tmp_path / "take", cameras=1, tracker="rgb", seed=1, calibration=False)
    frames = camera_frames(Take.open(tmp_path / "take").raw_path)
    assert list(frames) == ["camera_0"]
    picture = frames["camera_0"][10].picture
    assert picture is not None and (picture.width, picture.height) == (1440, 1080)
    assert np.isfinite(picture.pixels[INDEX["left_knee"]]).all()


def test_a_camera_client_sends_landmarks_in_real_time() -> None:
    config = parse_source("simulated-rgb:1/2:7")
    assert isinstance(config, SimulatedRgbConfig)
    source = config.open()
    frame = source.frame_at(5_000_000_000)
    assert source.joint_set == "mediapipe" and source.name == "camera_1"
    assert frame is not None and frame.picture is not None and np.isnan(frame.positions).all()
    assert np.isfinite(frame.picture.pixels).all() and frame.picture.world_m is not None
