"""The floor in depth images: found in small images, combined, and used by a calibration."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.performer.depth_floor import common_floor, is_floor, seen_floors
from studio.engine.calibration.performer.floor import Floor
from studio.engine.model.cameras.depth import DepthCamera
from tests.engine.calibration.scoring import stage_error
from tests.engine.calibration.synthetic import RIGS, record

CAMERA = DepthCamera(63.0, 63.0, 39.5, 35.5, 80, 72)


def image_of_floor(T_stage_camera: np.ndarray, noise: np.random.Generator) -> np.ndarray:
    """A depth image [mm] of an empty floor, up to 6 m away."""
    rays = np.concatenate([CAMERA.rays, np.ones((72, 80, 1), np.float32)], axis=2).astype(float)
    down = rays @ T_stage_camera[2, :3]
    z = np.where(down < -0.05, -T_stage_camera[2, 3] / np.minimum(down, -0.05), 0.0)
    z = np.where((z > 0.3) & (z < 6.0), z + noise.normal(0, 0.004, z.shape), 0.0)
    return np.round(z * 1e3).astype(np.uint16)


def true_floor(T_stage_camera: np.ndarray) -> Floor:
    return Floor(T_stage_camera[2, :3].copy(), -float(T_stage_camera[2, 3]))


def tilt_deg(a: Floor, b: Floor) -> float:
    return float(np.degrees(np.arccos(np.clip(a.up @ b.up, -1, 1))))


@pytest.mark.parametrize("index", [0, 1])
def test_the_floor_is_found_in_small_images(index):
    T, rng = RIGS[2][index], np.random.default_rng(index)
    empty = np.zeros((72, 80), np.uint16)
    found = seen_floors({"a": (CAMERA, [image_of_floor(T, rng) for _ in range(5)]), "b": (CAMERA, [empty])})
    assert list(found) == ["a"]
    assert tilt_deg(found["a"], true_floor(T)) < 0.2
    assert found["a"].height_m == pytest.approx(true_floor(T).height_m, abs=0.01)


def test_floors_of_several_cameras_become_one():
    poses = {"a": RIGS[2][0], "b": RIGS[2][1]}
    floors = {name: true_floor(T) for name, T in poses.items()} | {"c": Floor(np.array([1.0, 0, 0]), 3.0)}
    floor = common_floor(floors, poses, np.array([0.5, 0.5, 1.0]))
    assert floor is not None
    assert floor.up == pytest.approx([0, 0, 1], abs=1e-9) and floor.height_m == pytest.approx(0.0, abs=1e-9)
    assert common_floor(floors, {}, np.zeros(3)) is None


def test_a_table_is_not_the_floor():
    ground, around = Floor(np.array([0.0, 0.0, 1.0]), 0.0), np.array([1.0, 0.0, 1.0])
    assert is_floor(Floor(ground.up, 0.1), ground, around)
    assert not is_floor(Floor(ground.up, 0.7), ground, around)
    tilted = np.array([np.sin(0.3), 0.0, np.cos(0.3)])
    assert not is_floor(Floor(tilted, 0.3), ground, around)


def test_a_calibration_stands_on_the_floor_that_was_seen():
    """A tracker that sees every joint 5 cm too high puts the floor that is found from the feet too high."""
    frames, truth = record(3, RIGS[2])
    lifted = {
        name: [
            replace(one, positions=one.positions + truth.T_stage_camera[name][2, :3] * 0.05) for one in some
        ]
        for name, some in frames.items()
    }
    floors = {name: true_floor(T) for name, T in truth.T_stage_camera.items()}
    T = truth.T_stage_camera["camera_0"]
    by_feet, seen = calibrate(lifted), calibrate(lifted, floors=floors)
    assert not seen.refused, seen.reasons()
    tilt, height, _ = stage_error(seen, T)
    assert tilt < 0.3 and abs(height) < 0.015
    assert stage_error(by_feet, T)[1] > 0.03
    table = {name: Floor(floor.up, floor.height_m + 0.5) for name, floor in floors.items()}
    assert stage_error(calibrate(lifted, floors=table), T)[1] > 0.03


@pytest.mark.parametrize("name", ["punch_3_azure_kinect", "walk_2_kinect_v1"])
def test_the_floor_of_rendered_rooms(test_data, name):
    folder = test_data / "depth" / name
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    truth = json.loads((folder / "truth" / "cameras.json").read_text())
    for path in sorted(folder.glob("camera_*")):
        said = json.loads((path / "camera.json").read_text())
        step = 4
        camera = DepthCamera(
            *(said[key] / step for key in ("fx", "fy", "cx", "cy")),
            said["width"] // step,
            said["height"] // step,
        )
        files = sorted((path / "depth").glob("*.png"))[:60:10]
        images = [np.asarray(Image.open(file)).astype(np.uint16)[::step, ::step] for file in files]
        found = seen_floors({path.name: (camera, images)})[path.name]
        true = true_floor(np.array(truth[path.name]["T_stage_camera"]))
        assert tilt_deg(found, true) < 0.5, path.name
        assert found.height_m == pytest.approx(true.height_m, abs=0.02), path.name
