"""Keys of curves: what cubic keys gain, jumps without overshoot, and fewer keys within their bound."""

from pathlib import Path

import numpy as np
import pytest

from studio.engine.animation.clip.kinematics import local_keys, world_poses
from studio.engine.animation.curves import keys as curves
from studio.engine.animation.curves.keys import CurveKeys, curve_keys, fitted_keys, values_between
from studio.engine.animation.export import ExportOptions, export
from studio.engine.base.quaternions import multiply
from studio.engine.model.poses import Poses
from tests.engine.animation.export.readers.programs import ReadBack, read_with_ufbx
from tests.engine.animation.export.scoring import position_error_cm
from tests.poses_factory import random_poses


def _popped() -> Poses:
    """Poses whose left arm turns by 60 degrees from one frame to the next."""
    poses = random_poses(np.random.default_rng(7), seconds=2, hz=60, angle_sd_rad=0.1)
    offsets, local = local_keys(poses.parents, poses.positions_m, poses.rotations_wxyz)
    arm = poses.joint_names.index("LeftArm")
    local[60:, arm] = multiply(local[60:, arm], np.array([np.cos(np.pi / 6), 0, 0, np.sin(np.pi / 6)]))
    positions, rotations = world_poses(poses.parents, offsets, local)
    return Poses(
        poses.time_s,
        poses.joint_names,
        poses.parents,
        positions,
        rotations,
        poses.confidence,
        poses.uncertainty_mm,
    )


def _swing_cm(back: ReadBack, joint: str) -> np.ndarray:
    """Return how far a joint, read at four times the keys, leaves the straight line between keys, per interval."""
    places = back.positions_cm[:, back.names.index(joint)]
    begin, end = places[:-1:4], places[4::4]
    off = [places[k::4][: len(begin)] - (begin + (end - begin) * k / 4) for k in (1, 2, 3)]
    return np.linalg.norm(off, axis=-1).max(axis=0)


def test_a_jump_does_not_swing_the_curve_beside_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    export(_popped(), tmp_path / "a.fbx", "fbx")
    cured = _swing_cm(read_with_ufbx(tmp_path / "a.fbx", hz=240), "LeftHand")
    monkeypatch.setattr(curves, "JUMP_STEP", np.inf)
    export(_popped(), tmp_path / "b.fbx", "fbx")
    plain = _swing_cm(read_with_ufbx(tmp_path / "b.fbx", hz=240), "LeftHand")
    beside = [58, 60]  # the jump is in interval 59
    assert plain[beside].max() > 2.0
    assert cured[beside].max() < 0.4
    away = np.r_[0:56, 63:119]
    assert cured[away] == pytest.approx(plain[away], abs=1e-4)


def test_smooth_motion_keeps_automatic_tangents() -> None:
    track = 40 * np.sin(np.linspace(0, 9, 200))
    keys = curve_keys(track, 30.0, "cubic")
    assert np.isnan(keys.slopes[1:-1]).all() and np.isfinite(keys.slopes[[0, -1]]).all()
    assert np.isnan(curve_keys(track, 30.0, "linear").slopes).all()


def test_keys_follow_what_is_known_between_them() -> None:
    """Frame by frame noise at 120 Hz, as in captures, which automatic tangents at 30 Hz cannot follow."""
    rng = np.random.default_rng(3)
    dense = 40 * np.sin(np.linspace(0, 9, 801)) + rng.normal(scale=0.2, size=801)
    at_keys = dense[::4]

    def miss(between: np.ndarray | None) -> float:
        keys = curve_keys(at_keys, 30.0, "cubic", between=between)
        automatic = np.gradient(at_keys) * 30.0
        whole = CurveKeys(
            4 * keys.frames,
            keys.values,
            np.where(np.isnan(keys.slopes), automatic, keys.slopes),
            np.where(np.isnan(keys.lefts), automatic, keys.lefts),
        )
        return float(np.abs(values_between(whole, 801, 120.0) - dense).mean())

    straight = float(np.abs(np.interp(np.arange(801), np.arange(0, 801, 4), at_keys) - dense).mean())
    assert 2 * miss(dense) < straight
    assert 2 * miss(dense) < miss(None)


@pytest.mark.parametrize("interpolation", ["cubic", "linear"])
@pytest.mark.parametrize("tolerance", [1.0, 0.1, 0.001])
def test_fitted_keys_stay_within_the_tolerance(tolerance: float, interpolation: str) -> None:
    rng = np.random.default_rng(4)
    track = np.cumsum(rng.normal(size=500)) + 30 * np.sin(np.linspace(0, 20, 500))
    keys = fitted_keys(track, 60.0, tolerance, interpolation)
    assert keys.frames[0] == 0 and keys.frames[-1] == 499
    assert np.abs(values_between(keys, 500, 60.0) - track).max() <= tolerance * (1 + 1e-9)


def test_fitted_keys_of_a_smooth_curve_are_few() -> None:
    track = 40 * np.sin(np.linspace(0, 20, 600))
    assert len(fitted_keys(track, 60.0, 0.1, "cubic").frames) < 40
    assert len(fitted_keys(np.full(600, 3.0), 60.0, 0.1, "cubic").frames) == 1


@pytest.mark.parametrize(("error_cm", "share"), [(0.05, 0.6), (0.5, 0.3)])
def test_fewer_keys_hold_their_bound_as_ufbx_reads_them(
    tmp_path: Path, error_cm: float, share: float
) -> None:
    poses = random_poses(np.random.default_rng(7), seconds=3, hz=60, angle_sd_rad=0.3)
    sizes = {}
    for name, bound in (("all", None), ("few", error_cm)):
        export(poses, tmp_path / f"{name}.fbx", "fbx", ExportOptions(key_error_cm=bound))
        sizes[name] = read_with_ufbx(tmp_path / f"{name}.fbx", hz=1).scene["keys"]
    assert position_error_cm(read_with_ufbx(tmp_path / "few.fbx", hz=60), poses).max() <= error_cm * 1.01
    assert sizes["few"] < share * sizes["all"]


def test_a_pop_keeps_the_bound_of_fewer_keys(tmp_path: Path) -> None:
    export(_popped(), tmp_path / "few.fbx", "fbx", key_error_cm=0.1)
    assert position_error_cm(read_with_ufbx(tmp_path / "few.fbx", hz=60), _popped()).max() <= 0.101
