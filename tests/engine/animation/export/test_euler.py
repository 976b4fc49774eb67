"""Euler angles against scipy's rotations: exact, unrolled, through gimbal lock."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.animation.curves.euler import ORDERS, best_order, euler_deg


def _tumble(frames: int, seed: int) -> Rotation:
    """A body that spins smoothly about a changing axis, many turns."""
    rng = np.random.default_rng(seed)
    spin = np.array([0.05, 0.02, 0.03]) + 0.02 * np.sin(
        np.linspace(0, 9, frames)[:, None] + rng.uniform(0, 6, 3)
    )
    world = [Rotation.random(rng=rng)]
    for step in spin[1:]:
        world.append(Rotation.from_rotvec(step) * world[-1])
    return Rotation.concatenate(world)


def _error_deg(angles: np.ndarray, order: str, truth: Rotation) -> float:
    found = Rotation.from_euler(order, angles[:, ["XYZ".index(axis) for axis in order]], degrees=True)
    return float(np.degrees((truth.inv() * found).magnitude().max()))


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("seed", range(4))
def test_angles_give_the_rotation_back(order: str, seed: int) -> None:
    truth = _tumble(800, seed)
    angles = euler_deg(truth.as_quat(scalar_first=True), order)
    assert _error_deg(angles, order, truth) < 1e-6
    assert np.abs(np.diff(angles, axis=0)).max() < 185.0  # even straight through gimbal lock


@pytest.mark.parametrize("order", ORDERS)
def test_no_branch_jump_while_the_middle_axis_makes_whole_turns(order: str) -> None:
    degrees = np.linspace(0.0, 1080.0, 361)
    truth = Rotation.from_euler(order[1], degrees[:, None], degrees=True)
    angles = euler_deg(truth.as_quat(scalar_first=True), order)
    assert _error_deg(angles, order, truth) < 1e-6
    assert np.abs(np.diff(angles, axis=0)).max() < 3.001
    assert angles[-1, "XYZ".index(order[1])] == pytest.approx(1080.0)


@pytest.mark.parametrize("axis", [0, 2])
def test_turns_are_counted_about_an_outer_axis(axis: int) -> None:
    degrees = np.linspace(20.0, -1500.0, 300)
    truth = Rotation.from_euler("XYZ"[axis], degrees[:, None], degrees=True)
    angles = euler_deg(truth.as_quat(scalar_first=True), "ZYX")
    assert angles[-1, axis] - angles[0, axis] == pytest.approx(-1520.0)


def test_gimbal_lock_that_lasts_is_steady_and_exact() -> None:
    middle = np.concatenate([np.linspace(60, 90, 31), np.full(20, 90.0), np.linspace(90, 120, 31)])
    parts = np.column_stack([np.full(82, 25.0), middle, np.full(82, -40.0)])
    truth = Rotation.from_euler("ZYX", parts, degrees=True)
    angles = euler_deg(truth.as_quat(scalar_first=True), "ZYX")
    assert _error_deg(angles, "ZYX", truth) < 1e-4
    assert np.abs(np.diff(angles, axis=0)).max() < 1.1


def test_one_frame() -> None:
    assert euler_deg(np.array([[1.0, 0, 0, 0]]), "ZXY") == pytest.approx(np.zeros((1, 3)))


def test_order_is_the_usual_one_until_its_gimbal_lock_comes_near() -> None:
    swing = np.linspace(-40, 40, 50)[:, None]
    near = Rotation.from_euler("Y", 90 + swing / 10, degrees=True)
    assert best_order(Rotation.from_euler("Y", swing, degrees=True).as_quat(scalar_first=True)) == "ZYX"
    assert best_order(near.as_quat(scalar_first=True)) in ("XYZ", "YXZ", "YZX", "ZXY", "XZY")
    assert best_order(near.as_quat(scalar_first=True))[1] != "Y"
