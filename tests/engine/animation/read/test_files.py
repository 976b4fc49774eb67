"""Animation files read back: each reader returns what was exported; bad files give one clear error."""

import json
import struct
from importlib.util import find_spec

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.engine.animation.export import export
from studio.engine.animation.motion.motion import Motion
from studio.engine.animation.read.c3d import read_c3d
from studio.engine.animation.read.fbx import read_fbx
from studio.engine.animation.read.files import canonical_animation, read_animation
from studio.engine.animation.read.gltf import read_gltf
from studio.engine.animation.read.imported import imported_poses
from studio.engine.animation.read.landmarks import canonical_points, uses_markers
from studio.engine.animation.read.trc import read_trc
from studio.engine.base.errors import FormatError, NotAvailableError, SettingsError, StudioError
from studio.engine.model.joints import CANONICAL, INDEX, OUTPUT_INDEX, OUTPUT_OF_CANONICAL
from studio.engine.model.poses import Poses
from tests.poses_factory import random_poses
from tests.refused import refused

UFBX = pytest.mark.skipif(find_spec("ufbx") is None, reason="ufbx is not installed (extra fbx)")
SKELETONS = ["glb", "bvh", pytest.param("fbx", marks=UFBX)]
COLUMNS = [OUTPUT_INDEX[OUTPUT_OF_CANONICAL[name]] for name in CANONICAL]


@pytest.fixture(scope="module")
def poses() -> Poses:
    return random_poses(np.random.default_rng(11), seconds=0.8, angle_sd_rad=0.25)


@pytest.fixture(scope="module")
def files(poses, tmp_path_factory):
    """The poses in every format."""
    folder = tmp_path_factory.mktemp("files")
    for kind in ("glb", "bvh", "fbx", "c3d", "trc"):
        export(poses, folder / f"a.{kind}", kind)
    return folder


def rotation_error_deg(poses: Poses, other: Poses) -> float:
    a, b = (
        Rotation.from_quat(p.rotations_wxyz[:, order].reshape(-1, 4), scalar_first=True)
        for p, order in (
            (poses, slice(None)),
            (other, [other.joint_names.index(n) for n in poses.joint_names]),
        )
    )
    return float(np.degrees((a.inv() * b).magnitude().max()))


@pytest.mark.parametrize("kind", SKELETONS)
def test_a_skeleton_comes_back_as_it_was(files, poses, kind):
    unit = 0.01 if kind == "bvh" else None
    back, notes = imported_poses(files / f"a.{kind}", unit_m=unit)
    assert set(back.joint_names) == set(poses.joint_names)
    order = [back.joint_names.index(name) for name in poses.joint_names]
    assert np.abs(back.positions_m[:, order] - poses.positions_m).max() < 5e-5
    assert np.allclose(back.time_s, poses.time_s, atol=1e-4) and (back.confidence == 1).all()
    assert rotation_error_deg(poses, back) < 0.05
    assert "52 of known role" in notes[0]


@pytest.mark.parametrize(
    ("kind", "target"),
    [("glb", "mixamo"), ("glb", "unreal"), ("bvh", "vrm"), pytest.param("fbx", "unreal", marks=UFBX)],
)
def test_every_target_is_known_again(tmp_path, poses, kind, target):
    """Names, helper bones, bone axes and a root bone of other programs: the same poses are read back."""
    export(poses, tmp_path / f"t.{kind}", kind, target=target, root_motion="root")
    back, notes = imported_poses(tmp_path / f"t.{kind}", unit_m=0.01 if kind == "bvh" else None)
    assert "52 of known role" in notes[0]
    order = [back.joint_names.index(name) for name in poses.joint_names]
    assert np.abs(back.positions_m[:, order] - poses.positions_m).max() < 5e-5
    assert rotation_error_deg(poses, back) < 0.05


@pytest.mark.parametrize("kind", ["c3d", "trc"])
def test_points_come_back_as_they_were(files, poses, kind):
    points = {"c3d": read_c3d, "trc": read_trc}[kind](files / f"a.{kind}")
    assert np.abs(canonical_points(points) - poses.positions_m[:, COLUMNS]).max() < 1e-4
    assert not uses_markers(points) and np.allclose(np.diff(points.time_s), 1 / 60, atol=1e-9)
    back, _ = imported_poses(files / f"a.{kind}")
    assert np.abs(back.positions_m[:, COLUMNS] - poses.positions_m[:, COLUMNS]).max() < 1e-4
    assert (
        back.confidence[:, COLUMNS].min() == 1
        and back.confidence[:, OUTPUT_INDEX["LeftHandThumb2"]].max() == 0
    )


@pytest.mark.parametrize("kind", ["glb", "c3d", "trc", pytest.param("fbx", marks=UFBX)])
def test_canonical_joints_of_any_file(files, poses, kind):
    motion = canonical_animation(files / f"a.{kind}")
    joints = [joint for name, joint in INDEX.items() if name != "spine"]  # that is the first above the hips
    assert np.abs(motion.positions_m - poses.positions_m[:, COLUMNS])[:, joints].max() < 1e-3
    assert motion.offsets_m[INDEX["left_elbow"], 0] == pytest.approx(0.28, abs=1e-3)


def test_markers_alone_tell_the_joints_roughly(files, poses):
    points = read_c3d(files / "a.c3d")
    keep = [k for k, name in enumerate(points.names) if name.isupper()]
    alone = type(points)(points.time_s, tuple(points.names[k] for k in keep), points.positions_m[:, keep], ())
    found, truth = canonical_points(alone), poses.positions_m[:, COLUMNS]
    assert uses_markers(alone)
    # elbows of the random poses bend either way, so half of their centres are sought on the wrong side
    for name, bound in (("left_knee", 0.04), ("right_ankle", 0.04), ("left_hip", 0.08), ("right_wrist", 0.05),
                        ("left_elbow", 0.09), ("right_shoulder", 0.06), ("head", 0.15)):  # fmt: skip
        error = np.linalg.norm(found[:, INDEX[name]] - truth[:, INDEX[name]], axis=1).mean()
        assert error < bound, (name, error)


def test_an_a_pose_that_faces_elsewhere_is_brought_to_the_t_pose(tmp_path, poses):
    """A BVH whose rest pose has arms at 45 degrees and faces +x is read with the poses that the file shows."""
    from tests.engine.animation.motion.bvh_files import MIXAMO, bvh_text, channel_count

    turned = {}
    for name, (parent, (x, y, z)) in MIXAMO.items():
        arm = any(part in name for part in ("ForeArm", "Hand"))
        s = 1 if "Left" in name else -1
        if arm:
            along = abs(x)
            x, y = s * along * np.sqrt(0.5), -along * np.sqrt(0.5)
        turned[name] = (parent, (z, y, -x))
    frames = [[0, 95, 0, *[0] * (channel_count(turned) - 3)]] * 3
    (tmp_path / "a.bvh").write_text(bvh_text(turned, frames))
    back, _ = imported_poses(tmp_path / "a.bvh", unit_m=0.01)
    at = dict(zip(back.joint_names, back.positions_m[0], strict=True))
    turn = dict(
        zip(back.joint_names, Rotation.from_quat(back.rotations_wxyz[0], scalar_first=True), strict=True)
    )
    hips = turn["Hips"].as_matrix()
    assert np.allclose(hips @ [1, 0, 0], [0, 1, 0], atol=1e-6)  # its left hand is at the stage's +y
    for upper, lower in (("LeftArm", "LeftForeArm"), ("LeftForeArm", "LeftHand")):
        bone = at[lower] - at[upper]
        assert np.allclose(turn[upper].apply([1, 0, 0]), bone / np.linalg.norm(bone), atol=1e-6)
    bone = at["RightLeg"] - at["RightUpLeg"]
    assert np.allclose(turn["RightUpLeg"].apply([0, 0, -1]), bone / np.linalg.norm(bone), atol=1e-6)


def test_gaps_are_bridged_and_told(tmp_path, poses):
    from dataclasses import replace

    confidence = poses.confidence.copy()
    confidence[10:20, OUTPUT_INDEX["LeftHand"]] = 0.0
    export(replace(poses, confidence=confidence), tmp_path / "g.c3d", "c3d")
    points = read_c3d(tmp_path / "g.c3d")
    wrist = points.names.index("left_wrist")
    assert (
        np.isnan(points.positions_m[10:20, wrist]).all() and np.isfinite(points.positions_m[9, wrist]).all()
    )
    back, _ = imported_poses(tmp_path / "g.c3d")
    assert (back.confidence[10:20, OUTPUT_INDEX["LeftHand"]] == 0).all()
    assert np.isfinite(back.positions_m).all()


@pytest.mark.parametrize("kind", ["glb", "bvh", "c3d", "trc", pytest.param("fbx", marks=UFBX)])
@pytest.mark.parametrize("share", [0.0, 0.003, 0.6])
def test_a_file_that_was_cut_is_one_clear_error(files, tmp_path, kind, share):
    whole = (files / f"a.{kind}").read_bytes()
    path = tmp_path / f"cut.{kind}"
    path.write_bytes(whole[: int(len(whole) * share)])
    with pytest.raises(FormatError) as error:
        read_animation(path)
    assert str(error.value.values["path"]) == str(path)


@pytest.mark.parametrize("kind", ["glb", "c3d", "trc", pytest.param("fbx", marks=UFBX)])
def test_noise_in_the_file_never_breaks_the_program(files, tmp_path, kind):
    rng = np.random.default_rng(5)
    whole = np.frombuffer((files / f"a.{kind}").read_bytes(), np.uint8)
    for trial in range({"fbx": 2, "c3d": 4}.get(kind, 12)):
        broken = whole.copy()
        where = rng.integers(0, min(len(broken), 4000), 12)
        broken[where] = rng.integers(0, 256, len(where))
        path = tmp_path / f"noise_{trial}.{kind}"
        path.write_bytes(broken.tobytes())
        try:
            imported_poses(path)
        except StudioError as error:
            assert "noise_" in str(error) or "points" in str(error) or "joint" in str(error), error


def glb(tree: dict, binary: bytes = b"") -> bytes:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if binary:
        chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def rig(**changes) -> tuple[dict, bytes]:
    """A minimal animated file: hips that move over two keys."""
    binary = struct.pack("<2f", 0, 1) + struct.pack("<6f", 0, 1, 0, 0, 1, 1)
    tree = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"name": "Hips"}],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [{"buffer": 0, "byteLength": 8}, {"buffer": 0, "byteOffset": 8, "byteLength": 24}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR"},
                      {"bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3"}],
        "animations": [{"samplers": [{"input": 0, "output": 1}],
                        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}],
    }  # fmt: skip
    return tree | changes, binary


def test_the_smallest_rig_is_read(tmp_path):
    (tmp_path / "s.glb").write_bytes(glb(*rig()))
    motion = read_gltf(tmp_path / "s.glb")
    assert isinstance(motion, Motion) and np.allclose(motion.positions_m[-1, 0], [0, -1, 1], atol=0.05)


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": 9**9, "type": "SCALAR"}] * 2}, "gltf.fit"),
        ({"accessors": [{"bufferView": 0, "componentType": 5126, "count": -4, "type": "SCALAR"}] * 2}, "gltf.kind"),
        ({"accessors": [{"bufferView": 7, "componentType": 5126, "count": 2, "type": "SCALAR"}] * 2}, "gltf.no_item"),
        ({"bufferViews": [{"buffer": 0, "byteOffset": 1 << 40, "byteLength": 1 << 40}] * 2}, "gltf.fit"),
        ({"buffers": [{"byteLength": 8, "uri": "../../etc/passwd"}]}, "gltf.other_file"),
        ({"buffers": [{"byteLength": 8, "uri": "http://example.com/a.bin"}]}, "gltf.other_file"),
        ({"buffers": [{"byteLength": 8, "uri": "data:application/octet-stream;base64,###"}]}, "gltf.base64"),
        ({"nodes": [{"name": "Hips", "children": [0]}]}, "gltf.circle"),
        ({"nodes": [{"name": "Hips", "children": [9]}]}, "gltf.child"),
        ({"nodes": [{"name": "Hips", "scale": [0, 0, 0]}]}, "animation.scaled_to_nothing"),
        ({"nodes": [{"name": "Hips", "translation": ["a", 0, 0]}]}, "gltf.not_numbers"),
        ({"nodes": [{"name": "Cube"}]}, "animation.no_hips_joint"),
        ({"animations": []}, "gltf.no_animation"),
        ({"animations": [{"samplers": [], "channels": []}]}, "gltf.no_moved_node"),
        ({"extensionsRequired": ["EXT_meshopt_compression"]}, "gltf.extensions"),
        ({"asset": {"version": "1.0"}}, "gltf.not_version_2"),
        ({"nodes": "many"}, "gltf.no_list"),
        ({"skins": [{"joints": [5]}]}, "gltf.skin_joint"),
    ],
)  # fmt: skip
def test_what_a_gltf_file_cannot_say(tmp_path, changes, code):
    tree, binary = rig(**changes)
    if "uri" in json.dumps(changes):
        binary = b""
    (tmp_path / "h.glb").write_bytes(glb(tree, binary))
    with refused(FormatError, code):
        read_gltf(tmp_path / "h.glb")


def test_keys_that_are_not_finite(tmp_path):
    tree, binary = rig()
    (tmp_path / "n.glb").write_bytes(glb(tree, binary[:8] + struct.pack("<f", float("nan")) + binary[12:]))
    with refused(FormatError, "animation.damaged", error="gltf.key_of"):
        read_gltf(tmp_path / "n.glb")


def test_counts_that_the_file_is_too_short_for(files, tmp_path):
    content = bytearray((files / "a.c3d").read_bytes())
    content[8:10] = (65_000).to_bytes(2, "little")  # the last frame
    (tmp_path / "bomb.c3d").write_bytes(content)
    with refused(FormatError, "c3d.cut_off"):
        read_c3d(tmp_path / "bomb.c3d")
    lines = (files / "a.trc").read_text().split("\n")
    lines[2] = lines[2].replace("\t49\t", "\t4000000000\t", 1)
    (tmp_path / "bomb.trc").write_text("\n".join(lines))
    with refused(FormatError, "trc.cut_off"):
        read_trc(tmp_path / "bomb.trc")
    lines[2] = lines[2].replace("\tmm\t", "\tfurlongs\t")
    (tmp_path / "unit.trc").write_text("\n".join(lines))
    with refused(FormatError, "trc.header", error="'furlongs'"):
        read_trc(tmp_path / "unit.trc")


def test_other_endings_units_and_files_that_are_not_there(tmp_path, files):
    with refused(FormatError, "animation.ending"):
        read_animation(tmp_path / "a.obj")
    with refused(SettingsError, "animation.unit"):
        read_animation(files / "a.glb", unit_m=0.01)
    other = {"bvh": "bvh.unreadable", "trc": "file.unreadable_trc"}
    for kind in ("glb", "bvh", "c3d", "trc", "fbx"):
        with refused(FormatError, other.get(kind, "file.unreadable_give_other")):
            read_animation(tmp_path / f"missing.{kind}")


@UFBX
def test_an_fbx_without_animation_or_ufbx(files, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    (tmp_path / "ufbx.py").write_text("raise ImportError('not here')\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with refused(NotAvailableError, "fbx.not_installed"):
        read_fbx(files / "a.fbx")


def test_a_real_marker_file_against_the_skeleton_made_of_it(test_data):
    """CMU's C3D and BVH of the same walk: wrists, knees and ankles agree after a rigid alignment."""
    folder = test_data / "mocap"
    points = read_c3d(folder / "02_01.c3d")
    assert len(points.names) == 41 and "LKNE" in points.names and not points.notes
    found = canonical_points(points)
    truth = canonical_animation(folder / "02_01.bvh", unit_m=0.056444).positions_m[1:]
    names = ["left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle", "left_wrist",
             "right_wrist", "left_elbow", "right_elbow", "left_shoulder", "right_shoulder"]  # fmt: skip
    columns = [INDEX[name] for name in names]
    a, b = found[: len(truth), columns].reshape(-1, 3), truth[: len(found), columns].reshape(-1, 3)
    turn, _ = Rotation.align_vectors(b - b.mean(axis=0), a - a.mean(axis=0))
    error = np.linalg.norm(turn.apply(a - a.mean(axis=0)) + b.mean(axis=0) - b, axis=1)
    assert error.mean() < 0.06
