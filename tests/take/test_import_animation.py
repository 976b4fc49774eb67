"""Animations as takes: without raw, with the solve `imported`; nothing is left where one cannot be read."""

import numpy as np
import pytest

from studio.__main__ import main
from studio.engine.animation.export import export
from studio.engine.base.errors import FormatError, SettingsError, TakeError
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.reference import Reference, read_reference
from studio.engine.model.poses import Poses
from studio.take.folder.take import Take
from studio.take.importers import import_recording
from tests.poses_factory import random_poses
from tests.refused import refused


@pytest.fixture
def poses() -> Poses:
    return random_poses(np.random.default_rng(2), seconds=0.5)


def test_an_animation_becomes_a_take_that_exports_like_any_other(tmp_path, poses, capsys):
    export(poses, tmp_path / "walk.glb", "glb")
    take_path = tmp_path / "sessions" / "day" / "walk"
    assert main(["import", str(tmp_path / "walk.glb"), "--out", str(take_path)]) == 0
    assert "solve imported" in capsys.readouterr().out
    take = Take.open(take_path)
    assert (take.solve_names() == ["imported"] and take.camera_names == []) or take.camera_names == ()
    assert take.meta["source"] == "import" and "walk.glb, 31 frames at 60 Hz" in take.meta["notes"]
    assert not take.raw_path.exists() and take.meta["recording"] == "done"
    back = Poses.load(take.solve_folder("imported") / "poses.npz")
    order = [back.joint_names.index(name) for name in poses.joint_names]
    assert np.abs(back.positions_m[:, order] - poses.positions_m).max() < 1e-4
    assert main(["export", str(take_path), "--format", "bvh", "--out", str(tmp_path / "again.bvh")]) == 0
    assert (tmp_path / "again.bvh").stat().st_size > 10_000
    assert main(["doctor", str(tmp_path / "sessions")]) == 0


def test_a_take_without_raw_says_so_where_raw_is_needed(tmp_path, poses, capsys):
    export(poses, tmp_path / "walk.trc", "trc")
    assert main(["import", str(tmp_path / "walk.trc"), "--out", str(tmp_path / "take")]) == 0
    assert main(["calibrate", str(tmp_path / "take")]) == 1
    assert "no raw recording" in capsys.readouterr().err


def test_the_unit_of_a_bvh(tmp_path, poses):
    export(poses, tmp_path / "walk.bvh", "bvh")
    import_recording(tmp_path / "walk.bvh", tmp_path / "take", unit_m=0.01)
    back = Poses.load(tmp_path / "take" / "solves" / "imported" / "poses.npz")
    assert np.abs(back.positions_m[:, 0] - poses.positions_m[:, 0]).max() < 1e-4
    export(poses, tmp_path / "walk.glb", "glb")
    with refused(SettingsError, "animation.unit"):
        import_recording(tmp_path / "walk.glb", tmp_path / "other", unit_m=0.01)
    with refused(SettingsError, "import.unit"):
        import_recording(tmp_path, tmp_path / "other", unit_m=0.01)


def test_nothing_is_left_of_a_file_that_cannot_be_read(tmp_path, poses):
    export(poses, tmp_path / "walk.glb", "glb")
    whole = (tmp_path / "walk.glb").read_bytes()
    (tmp_path / "cut.glb").write_bytes(whole[: len(whole) // 2])
    with refused(FormatError, "gltf.cut_off"):
        import_recording(tmp_path / "cut.glb", tmp_path / "new" / "take")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cut.glb", "walk.glb"]
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "x").write_text("")
    with refused(TakeError, "take.not_empty"):
        import_recording(tmp_path / "walk.glb", tmp_path / "taken")


def test_a_recording_of_cmu_becomes_a_take(tmp_path, test_data):
    take = import_recording(test_data / "mocap" / "02_01.bvh", tmp_path / "take", unit_m=0.056444)
    assert "26 of known role" in take.meta["notes"]
    back = Poses.load(take.solve_folder("imported") / "poses.npz")
    knees = back.positions_m[:, [back.joint_names.index(f"{side}Leg") for side in ("Left", "Right")], 2]
    assert 0.2 < knees.min() and knees.max() < 0.8 and back.frame_count == 344


def test_an_animation_of_the_studio_is_its_own_reference(tmp_path, poses):
    export(poses, tmp_path / "walk.glb", "glb")
    reference = read_reference(tmp_path / "walk.glb")
    assert isinstance(reference, Reference) and reference.known.all()
    assert np.abs(reference.positions_m - canonical_positions(poses)).max() < 1e-4
