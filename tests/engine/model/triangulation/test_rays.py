"""Rays of cameras without depth: where all cameras together, or one picture alone, place the joints."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.model.calibration import CameraCalibration, Performer
from studio.engine.model.cameras.lens import Lens
from studio.engine.model.frames import CameraFrame, PictureJoints
from studio.engine.model.human.anthropometry import anthropometric_positions
from studio.engine.model.joints import INDEX, MIRROR, PARENTS
from studio.engine.model.triangulation.rays import guessed, nearest_on_rays, on_rays, placed
from studio.engine.solve.timing.sync import Synchroniser

LENS = Lens(900.0, 900.0, 359.5, 639.5, 720, 1280, (0.05, -0.1, 0.0, 0.001))
JOINTS = anthropometric_positions(1.75)
SURE = np.ones(21)
NOT_SHOWN = [INDEX["hips"], INDEX["neck"]]
BETWEEN_M = 3e-3
"""Largest distance of points between joints in a picture from those between them on the stage, 4 m away."""

UP_M = np.array([0.0, 0.0, 0.5])


def looking(from_deg: float, distance_m: float = 4.0) -> CameraCalibration:
    """A camera at the height of the hips that looks at the performer."""
    angle = np.radians(from_deg)
    forward = -np.array([np.sin(angle), -np.cos(angle), 0.0])
    T = np.eye(4)
    T[:3, :3] = np.column_stack([np.cross([0.0, 0.0, -1.0], forward), [0.0, 0.0, -1.0], forward])
    T[:3, 3] = np.array([0.0, 0.0, 1.0]) - distance_m * forward
    return CameraCalibration(T, lens=LENS)


def seen_by(camera: CameraCalibration, joints: np.ndarray = JOINTS) -> PictureJoints:
    T = np.linalg.inv(camera.T_stage_camera)
    local = joints @ T[:3, :3].T + T[:3, 3]
    return PictureJoints(720, 1280, LENS.pixels_of(local), local - local[0])


def body_of(joints: np.ndarray) -> Performer:
    """A performer who stands in a T-pose with these joints."""
    return Performer(1.75, joints - np.where((PARENTS >= 0)[:, None], joints[np.maximum(PARENTS, 0)], 0.0))


def rays_of(cameras: list[CameraCalibration]) -> tuple[np.ndarray, np.ndarray]:
    """Points on the rays of exact pictures, and the cameras' places."""
    found = np.array([on_rays(camera, seen_by(camera)) for camera in cameras])
    return found, np.array([camera.T_stage_camera[:3, 3] for camera in cameras])


@pytest.mark.parametrize("angles", [(0, 90), (-30, 30, 180), (0, 60, 120, 200)])
def test_exact_rays_meet_at_the_joints(angles):
    found, centres = rays_of([looking(angle) for angle in angles])
    out, _ = placed(found, np.ones((len(angles), 21)), centres, np.ones(len(angles), bool))
    assert np.abs(out - JOINTS).max() < 1e-4


def test_one_camera_that_is_wrong_does_not_count():
    cameras = [looking(angle) for angle in (0, 70, 140, 220)]
    found, centres = rays_of(cameras)
    found[2] = on_rays(cameras[2], seen_by(cameras[2], JOINTS + UP_M))
    out, _ = placed(found, np.ones((4, 21)), centres, np.ones(4, bool))
    assert np.linalg.norm(out[[0, 1, 3]] - JOINTS, axis=2).max() < 0.02


@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_a_camera_that_exchanges_left_and_right_is_put_right(wrong):
    found, centres = rays_of([looking(angle) for angle in (0, 50, 110)])
    found[wrong] = found[wrong][MIRROR]
    sure = np.ones((3, 21))
    sure[wrong, INDEX["left_wrist"]] = 0.4
    out, confidence = placed(found, sure, centres, np.ones(3, bool))
    assert np.abs(out - JOINTS).max() < 1e-3 and confidence[wrong, INDEX["right_wrist"]] == 0.4


def test_rays_of_cameras_beside_each_other_say_nothing_of_depth():
    found, centres = rays_of([looking(0), looking(2)])
    assert np.isnan(placed(found, np.ones((2, 21)), centres, np.ones(2, bool))[0]).all()


def test_a_depth_camera_says_how_far_a_ray_goes():
    cameras = [looking(0), looking(90)]
    found, centres = rays_of(cameras)
    found[1] = JOINTS
    out, _ = placed(found, np.ones((2, 21)), centres, np.array([True, False]))
    assert np.abs(out - JOINTS).max() < 1e-4


def test_unseen_joints_stay_unseen():
    found, centres = rays_of([looking(0), looking(90), looking(180)])
    found[0, 3], found[1:, 4] = np.nan, np.nan
    out, _ = placed(found, np.ones((3, 21)), centres, np.ones(3, bool))
    assert np.isnan(out[0, 3]).all() and np.isfinite(out[1:, 3]).all() and np.isnan(out[:, 4]).all()


def test_one_picture_places_a_body_of_known_size():
    camera = looking(20)
    assert np.abs(guessed(camera, seen_by(camera), SURE, 1.0) - JOINTS).max() < 1e-6
    small = replace(seen_by(camera), world_m=seen_by(camera).world_m / 1.1)
    assert np.abs(guessed(camera, small, SURE, 1.1) - JOINTS).max() < 1e-6


def test_too_few_joints_place_nobody():
    camera = looking(20)
    assert np.isnan(guessed(camera, seen_by(camera), np.where(np.arange(21) < 5, 1.0, 0.1), 1.0)).all()


def test_the_nearest_point_of_a_ray():
    camera = looking(0)
    found, centre = on_rays(camera, seen_by(camera)), camera.T_stage_camera[:3, 3]
    assert np.abs(nearest_on_rays(found, centre, JOINTS) - JOINTS).max() < 1e-6


def test_a_picture_of_another_shape_shows_nobody():
    camera = looking(0)
    turned = replace(seen_by(camera), width=1280, height=720)
    assert np.isnan(on_rays(camera, turned)).all()


def test_a_frame_set_has_the_joints_on_their_rays_and_says_so():
    cameras = {"a": looking(0), "b": looking(80)}
    sync = Synchroniser(cameras, performer=body_of(JOINTS))
    for name, camera in cameras.items():
        sync.add(CameraFrame(name, 0, 0, np.full((21, 3), np.nan), SURE, picture=seen_by(camera)))
    frames = sync.frame_set(0)
    off = np.abs(frames.positions - JOINTS)
    assert frames.rays.all() and np.delete(off, NOT_SHOWN, axis=1).max() < 1e-4
    assert off.max() < BETWEEN_M
    assert [reading.along_m for reading in frames.readings] == [10.0, 10.0]


@pytest.mark.parametrize(("hips_m", "neck_m"), [(0.0, 0.0), (0.12, -0.07), (0.03, 0.12)])
def test_hips_and_neck_of_pictures_are_where_the_body_has_them(hips_m: float, neck_m: float):
    """A picture shows hip joints and shoulders; the places of hips and neck depend on the body."""
    joints = JOINTS.copy()
    for name, other, up_m in (("hips", "left_hip", hips_m), ("neck", "left_shoulder", neck_m)):
        joints[INDEX[name]] = [0.0, 0.0, JOINTS[INDEX[other], 2] + up_m]
    cameras = {"a": looking(0), "b": looking(80)}
    sync = Synchroniser(cameras, performer=body_of(joints))
    for name, camera in cameras.items():
        sync.add(CameraFrame(name, 0, 0, np.full((21, 3), np.nan), SURE, picture=seen_by(camera)))
    found = sync.frame_set(0).positions
    assert np.abs(found[:, NOT_SHOWN] - joints[NOT_SHOWN]).max() < BETWEEN_M


def test_a_camera_without_a_lens_sees_nobody():
    camera = looking(0)
    sync = Synchroniser({"a": replace(camera, lens=None), "b": looking(80)})
    sync.add(CameraFrame("a", 0, 0, np.full((21, 3), np.nan), SURE, picture=seen_by(camera)))
    frames = sync.frame_set(0)
    assert np.isnan(frames.positions).all() and not frames.confidence.any()
