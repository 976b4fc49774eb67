"""Noise, steps, shadows and holes match the sources of the sensors."""

import numpy as np
import pytest

from studio.engine.base.errors import SettingsError
from studio.simulator.sensor import structured_light, time_of_flight
from studio.simulator.sensor.sensors import SENSORS, StructuredLight, TimeOfFlight, find_sensor
from studio.simulator.sensor.view import SensorView
from tests.refused import refused

SHAPE = (120, 160)
FRAMES = 12


def wall(distance_m, cosine=1.0, corner=0.0, albedo=0.5):
    full = [np.full(SHAPE, value, np.float32) for value in (distance_m, cosine, albedo, corner)]
    return SensorView(*full)


def measure(name, view, seed=0, cameras=1, frames=FRAMES):
    sensor, rng = SENSORS[name], np.random.default_rng(seed)
    if isinstance(sensor.family, StructuredLight):
        return np.stack([structured_light.measure(sensor, view, rng, cameras) for _ in range(frames)])
    return np.stack([time_of_flight.measure(sensor, view, rng) for _ in range(frames)])


def sd_mm(images):
    return images[images > 0].astype(float).std()


@pytest.mark.parametrize("distance_m", [1.5, 2.0, 3.0, 4.0])
def test_kinect_v1_noise_is_quadratic(distance_m):
    """1.425e-3 z^2 (Khoshelham 2012), with the steps between 1.4 and 1.9e-3."""
    assert 1.3e-3 < 1e-3 * sd_mm(measure("kinect-v1", wall(distance_m))) / distance_m**2 < 2.0e-3


def test_kinect_v1_depth_has_steps():
    values = np.unique(measure("kinect-v1", wall(3.0)))
    values = values[values > 0]
    step_mm = 1e3 * 3.0**2 / (SENSORS["kinect-v1"].camera.fx * 0.075) / 16
    assert np.median(np.diff(values)) == pytest.approx(step_mm, rel=0.1)  # 1/8 pixel of 640 columns


@pytest.mark.parametrize(("distance_m", "expected_mm"), [(1.0, 1.3), (2.0, 1.7), (3.0, 2.7), (4.0, 4.3)])
def test_kinect_v2_noise(distance_m, expected_mm):
    """1.5 - 0.5 z + 0.3 z^2 mm facing a wall (Fankhauser 2015)."""
    assert sd_mm(measure("kinect-v2", wall(distance_m))) == pytest.approx(expected_mm, rel=0.1)


def test_azure_kinect_noise_stays_within_its_specification():
    near, far = (sd_mm(measure("azure-kinect", wall(z))) for z in (1.0, 4.0))
    assert 1.0 < near < far < 17.0  # SD of at most 17 mm


def test_dark_surfaces_are_noisier_and_get_lost():
    assert sd_mm(measure("azure-kinect", wall(2.5, albedo=0.1))) > 1.8 * sd_mm(
        measure("azure-kinect", wall(2.5))
    )
    assert (measure("azure-kinect", wall(4.5, albedo=0.04)) == 0).all()


def test_stereo_noise_is_quadratic():
    """z^2 * subpixel / (focal length * baseline) with a subpixel of 0.08 (Intel)."""
    for distance_m in (1.0, 2.0, 3.0):
        expected_mm = 1e3 * distance_m**2 * 0.08 / (424.0 * 0.05)
        assert sd_mm(measure("d435", wall(distance_m))) == pytest.approx(expected_mm, rel=0.35)


def test_corners_look_further_away_to_time_of_flight():
    bias = measure("kinect-v2", wall(2.0, corner=1.0)).mean() - measure("kinect-v2", wall(2.0)).mean()
    assert bias == pytest.approx(22.0, abs=1.0)


def step_view(front_m=1.5, back_m=3.0):
    view = wall(back_m)
    view.depth_m[30:90, 60:100] = front_m
    return view


def test_structured_light_casts_a_shadow_to_the_left():
    sensor = SENSORS["kinect-v1"]
    images = measure("kinect-v1", step_view())
    width = sensor.camera.fx * sensor.family.baseline_m * (1 / 1.5 - 1 / 3.0)
    lost = (images[:, 40:80] == 0).mean(axis=(0, 1))
    assert lost[int(62 - width) : 59].min() > 0.9
    assert lost[: int(58 - width)].max() < 0.2 and lost[103:].max() < 0.2


@pytest.mark.parametrize("name", ["kinect-v2", "azure-kinect"])
def test_time_of_flight_has_flying_pixels_at_edges_alone(name):
    images = measure(name, step_view())
    between = (images > 1600) & (images < 2900)
    assert between[:, 35:85, 59:61].mean() > 0.1
    assert not between[:, :, :57].any() and not between[:, 40:80, 64:96].any()
    assert (images[:, 35:85, 59:61] == 0).mean() > 0.15


def test_interference_grows_and_four_cameras_are_too_many():
    lost = [(measure("kinect-v1", wall(2.5), cameras=n, frames=20) == 0).mean() for n in (1, 2, 3, 4)]
    assert lost == sorted(lost)
    assert lost[2] < 0.12 and lost[3] > 0.3
    assert (measure("d435", wall(2.5), cameras=4) == 0).mean() < 0.01


@pytest.mark.parametrize("name", [name for name, sensor in SENSORS.items() if sensor.family is not None])
def test_range_and_seed(name):
    near, far = SENSORS[name].range_m
    assert (measure(name, wall(near * 0.8), frames=1) == 0).all()
    assert (measure(name, wall(far * 1.1), frames=1) == 0).mean() > 0.98
    view = step_view()
    np.testing.assert_array_equal(
        measure(name, view, seed=5, frames=2), measure(name, view, seed=5, frames=2)
    )
    assert (measure(name, view, seed=5, frames=1) != measure(name, view, seed=6, frames=1)).any()


def test_sensors_have_plausible_intrinsics():
    degrees = {"kinect-v1": 58, "kinect-v2": 70, "azure-kinect": 65, "azure-kinect-unbinned": 65, "femto-bolt": 65,
               "d435": 90}  # fmt: skip
    for name, expected in degrees.items():
        camera = SENSORS[name].camera
        assert np.degrees(2 * np.arctan(0.5 * camera.width / camera.fx)) == pytest.approx(expected, abs=3)
        assert isinstance(SENSORS[name].family, StructuredLight | TimeOfFlight)
    with refused(SettingsError, "value.unknown"):
        find_sensor("kinect-v9")
