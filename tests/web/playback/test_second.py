"""A second figure beside a clip: another solve, lined up or not, and a reference."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.api.stage.shown import SecondFigure
from studio.engine.base.errors import SettingsError
from studio.engine.base.geometry import transform_points
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.reference import Reference
from studio.web.playback.clip import Clip
from studio.web.playback.second import Second, alignment_of, joints_at
from tests.refused import refused
from tests.web.playback.takes import take_with_solves


@pytest.fixture
def clip(tmp_path):
    return Clip.load(take_with_solves(tmp_path / "monday" / "one"), "studio")


def test_another_take_begins_with_the_clip_and_stands_aside(clip, tmp_path):
    other = Clip.load(take_with_solves(tmp_path / "monday" / "two", seed=1), "live")
    second = Second.solve(other, clip)
    assert second.name == SecondFigure("monday/two", "live")
    shown = second.step(float(clip.poses.time_s[30]), apart_m=1.5)
    np.testing.assert_allclose(shown.positions_m, other.poses.positions_m[30] + [1.5, 0.0, 0.0])


def test_a_solve_that_is_lined_up_lies_where_it_was_found(clip):
    turn = Rotation.from_euler("z", 30, degrees=True)
    alignment = alignment_of(
        {
            "rotation_wxyz": turn.as_quat(scalar_first=True).tolist(),
            "translation_m": [1.0, 0.0, 0.0],
            "time_offset_ms": 500.0,
        }
    )
    second = Second.solve(clip, clip, alignment)
    assert second.name.lined_up
    shown = second.step(float(clip.poses.time_s[30]))
    back = transform_points(alignment.T_reference_stage, shown.positions_m)
    np.testing.assert_allclose(back, clip.poses.positions_m[60], atol=1e-9)
    turned = turn * Rotation.from_quat(shown.rotations_wxyz[0], scalar_first=True)
    own = Rotation.from_quat(clip.poses.rotations_wxyz[60, 0], scalar_first=True)
    assert (turned * own.inv()).magnitude() < 1e-6


@pytest.mark.parametrize(
    "wrong", [{"scale": 0.0}, {"rotation_wxyz": [1, 1, 0, 0]}, {"time_offset_ms": float("nan")}]
)
def test_no_alignment(wrong):
    with refused(SettingsError, "replay.alignment"):
        alignment_of(wrong)


def test_a_reference_is_joints_between_its_samples(clip):
    poses = clip.poses
    motion = Reference(poses.time_s[::2], canonical_positions(poses)[::2])
    second = Second.reference("monday/one", "truth.csv", motion)
    shown = second.step(float(poses.time_s[10]))
    assert np.isnan(shown.positions_m).all()
    np.testing.assert_allclose(shown.fused.positions, canonical_positions(poses)[10])
    middle = joints_at(motion, float(poses.time_s[10:13:2].mean()))
    np.testing.assert_allclose(middle, canonical_positions(poses)[[10, 12]].mean(axis=0))
    assert np.isnan(joints_at(motion, float(poses.time_s[-1]) + 1.0)).all()
