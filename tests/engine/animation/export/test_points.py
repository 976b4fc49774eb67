"""C3D, TRC, CSV and npz: points read back by independent programs; gaps stay gaps."""

import sys
import warnings
from dataclasses import replace
from importlib.util import find_spec

import c3d
import ezc3d
import numpy as np
import pytest

from studio.engine.animation.clip.skeleton import to_file_axes
from studio.engine.animation.export import export
from studio.engine.animation.export.points import points_of
from studio.engine.base.errors import FormatError, NotAvailableError, StudioError
from studio.engine.metrics.reference.reference import read_reference
from studio.engine.model.joints import CANONICAL, OUTPUT_INDEX, OUTPUT_OF_CANONICAL
from studio.engine.model.poses import Poses
from tests.poses_factory import random_poses, t_pose
from tests.refused import refused

PLUG_IN_GAIT = 39  # markers of the full-body set


@pytest.fixture(scope="module")
def poses():
    """Two seconds of motion; the left wrist is unseen for a while, and its radius is known."""
    made = random_poses(np.random.default_rng(7), seconds=2.0)
    confidence, radius = made.confidence.copy(), np.full_like(made.confidence, 21.4)
    confidence[30:50, OUTPUT_INDEX["LeftHand"]] = 0.0
    radius[:, OUTPUT_INDEX["Head"]] = np.nan
    return replace(made, confidence=confidence, uncertainty_mm=radius)


def read_with_c3d(path):
    """Labels, positions [mm], residuals [mm] and the rate, as read by the library c3d."""
    with warnings.catch_warnings(), path.open("rb") as file:
        warnings.simplefilter("ignore")
        reader = c3d.Reader(file)
        values = np.array([points for _, points, _ in reader.read_frames()])
        return [label.strip() for label in reader.point_labels], values[..., :3], values[..., 3], reader


def test_c3d_holds_centres_and_markers_and_keeps_the_gaps(tmp_path, poses):
    export(poses, tmp_path / "a.c3d", "c3d")
    labels, positions, residuals, reader = read_with_c3d(tmp_path / "a.c3d")
    points = points_of(poses)
    assert labels == list(points.labels) and set(CANONICAL) <= set(labels)
    assert len(labels) - sum(label.isupper() for label in labels) == 21 + 3  # Spine1 and the clavicles
    assert sum(label.isupper() for label in labels) == PLUG_IN_GAIT
    assert reader.point_rate == 60 and reader.header.first_frame == 1 and len(positions) == poses.frame_count
    assert reader.get("POINT").get("UNITS").string_value.strip() == "mm"
    gaps = np.isnan(points.positions_m).any(axis=2)
    assert np.array_equal(residuals == -1, gaps) and gaps.sum() >= 20
    assert np.abs(positions - points.positions_m * 1000)[~gaps].max() < 0.1
    assert (residuals[:, labels.index("right_knee")] == 21).all()
    assert (residuals[:, labels.index("head")] == 0).all()
    again = ezc3d.c3d(str(tmp_path / "a.c3d"))
    assert again["parameters"]["POINT"]["Y_SCREEN"]["value"] == ["+Z"]
    assert np.isnan(again["data"]["points"][0].T[gaps]).all()


def still_for(frames):
    """Poses that stand still at 60 Hz."""
    still = t_pose(1)
    names = ("positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")
    repeated = {name: np.repeat(getattr(still, name), frames, axis=0) for name in names}
    return replace(still, time_s=np.arange(frames) / 60, **repeated)


def test_c3d_where_its_library_has_no_wheel(tmp_path, poses, monkeypatch):
    """As on Linux on ARM, where the library c3d has no wheel."""
    monkeypatch.setitem(sys.modules, "ezc3d", None)
    with refused(NotAvailableError, "c3d.not_installed"):
        export(poses, tmp_path / "out.c3d", "c3d")
    assert not (tmp_path / "out.c3d").exists()


def test_a_c3d_that_its_header_cannot_count(tmp_path):
    long = still_for(66_000)
    with refused(FormatError, "export.c3d_frames", most=65535):
        export(long, tmp_path / "b.c3d", "c3d")
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_a_c3d_of_ten_minutes(tmp_path):
    export(still_for(36_000), tmp_path / "b.c3d", "c3d")
    assert ezc3d.c3d(str(tmp_path / "b.c3d"))["data"]["points"].shape[2] == 36_000


def test_markers_keep_their_distance_from_their_bone_and_lie_outside(poses):
    points = points_of(replace(poses, confidence=np.ones_like(poses.confidence)))
    at = dict(zip(points.labels, points.positions_m.transpose(1, 0, 2), strict=True))
    for marker, joint, low, high in (
        ("LKNE", "left_knee", 0.03, 0.09), ("RELB", "right_elbow", 0.03, 0.07), ("LANK", "left_ankle", 0.03, 0.08),
        ("C7", "neck", 0.03, 0.2), ("LASI", "left_hip", 0.06, 0.2), ("RWRA", "right_wrist", 0.02, 0.08),
    ):  # fmt: skip
        distance = np.linalg.norm(at[marker] - at[joint], axis=1)
        assert low < distance.mean() < high, (marker, distance.mean())
    for marker, joint in (
        ("LTOE", "left_ankle"),
        ("RFIN", "right_wrist"),
        ("LFHD", "head"),
        ("LTHI", "left_hip"),
    ):
        assert np.ptp(np.linalg.norm(at[marker] - at[joint], axis=1)) < 1e-6


def test_left_and_right_markers_mirror_each_other_in_the_t_pose():
    points = points_of(t_pose(1))
    at = dict(zip(points.labels, points.positions_m[0], strict=True))
    for name in at:
        if name.isupper() and name[0] == "L" and name != "LBAK":
            assert np.allclose(at[name] * [-1, 1, 1], at["R" + name[1:]], atol=2e-3), name


def test_trc_is_read_as_opensim_lays_it_out(tmp_path, poses):
    export(poses, tmp_path / "c.trc", "trc", fps=30.0)
    lines = (tmp_path / "c.trc").read_text().splitlines()
    assert lines[0].split("\t")[:3] == ["PathFileType", "4", "(X/Y/Z)"]
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    labels = lines[3].split("\t")[2::3][: int(header["NumMarkers"])]
    assert header["Units"] == "mm" and float(header["DataRate"]) == 30 and lines[5] == ""
    rows = [line.split("\t") for line in lines[6:]]
    assert len(rows) == int(header["NumFrames"]) == 61 and lines[4].split("\t")[2:5] == ["X1", "Y1", "Z1"]
    values = np.array([[np.nan if cell == "" else float(cell) for cell in row] for row in rows])
    assert values.shape == (61, 2 + 3 * len(labels))
    assert np.array_equal(values[:, 0], np.arange(1, 62)) and values[-1, 1] == pytest.approx(2.0)
    knee = 2 + 3 * labels.index("left_knee")
    truth = to_file_axes(poses.positions_m[::2, OUTPUT_INDEX["LeftLeg"]]) * 1000
    assert np.abs(values[:, knee : knee + 3] - truth).max() < 0.1
    wrist = 2 + 3 * labels.index("left_wrist")
    assert np.isnan(values[15:25, wrist]).all() and not np.isnan(values[26:, wrist]).any()


def test_a_csv_is_a_reference_of_evaluate(tmp_path, poses):
    export(poses, tmp_path / "d.csv", "csv")
    reference = read_reference(tmp_path / "d.csv")
    columns = [OUTPUT_INDEX[OUTPUT_OF_CANONICAL[name]] for name in CANONICAL]
    assert np.allclose(reference.positions_m, poses.positions_m[:, columns], atol=1e-5)
    assert np.allclose(reference.time_s, poses.time_s, atol=1e-6)
    header, first = (tmp_path / "d.csv").read_text().splitlines()[:2]
    row = dict(zip(header.split(","), first.split(","), strict=True))
    assert row["head_uncertainty_mm"] == "" and float(row["left_knee_uncertainty_mm"]) == 21.4
    assert float(row["LeftHandIndex3_confidence"]) == 1.0


def test_an_npz_is_the_solve_itself(tmp_path, poses):
    export(poses, tmp_path / "e.npz", "npz")
    back = Poses.load(tmp_path / "e.npz")
    assert np.array_equal(back.positions_m, poses.positions_m) and back.joint_names == poses.joint_names


@pytest.mark.parametrize("format", ["c3d", "trc"])
def test_a_rig_without_a_limb_or_poses_that_nobody_saw(tmp_path, format, poses):
    names = tuple("X" if name == "RightLeg" else name for name in poses.joint_names)
    with refused(FormatError, "export.mesh_lacks", names=["RightLeg"]):
        export(replace(poses, joint_names=names), tmp_path / f"f.{format}", format)
    with refused(FormatError, "export.no_point"):
        export(replace(poses, confidence=0.0 * poses.confidence), tmp_path / f"f.{format}", format)
    with refused(StudioError, "export.not_for_format"):
        export(poses, tmp_path / f"f.{format}", format, mesh=True)
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(find_spec("pxr") is not None, reason="usd-core is installed")
def test_usd_without_its_package_says_what_to_install(tmp_path, poses):
    with refused(NotAvailableError, "export.no_usd"):
        export(poses, tmp_path / "g.usd", "usd")
    assert not list(tmp_path.iterdir())


def test_usd_is_read_by_its_own_skeleton_query(tmp_path, poses):
    pytest.importorskip("pxr", reason="usd-core is not installed")
    from pxr import Usd, UsdGeom, UsdSkel

    export(poses, tmp_path / "h.usdc", "usd", take_name="Take 1")
    stage = Usd.Stage.Open(str(tmp_path / "h.usdc"))
    assert UsdGeom.GetStageUpAxis(stage) == "Y" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    cache, root = UsdSkel.Cache(), UsdSkel.Root(stage.GetPrimAtPath("/Performer"))
    cache.Populate(root, Usd.PrimDefaultPredicate)
    query = cache.GetSkelQuery(UsdSkel.Skeleton(stage.GetPrimAtPath("/Performer/Skeleton")))
    found = np.array(query.ComputeJointSkelTransforms(Usd.TimeCode(60)))[:, 3, :3]
    assert np.abs(found - to_file_axes(poses.positions_m[60])).max() < 5e-4
    mesh = stage.GetPrimAtPath("/Performer/Mannequin")
    points = UsdGeom.Mesh(mesh).GetPointsAttr().Get()
    skinning = cache.GetSkinningQuery(mesh)
    assert skinning.ComputeSkinnedPoints(query.ComputeSkinningTransforms(60), points)
    assert 1.2 < np.ptp(np.array(points), axis=0).max() < 2.2
