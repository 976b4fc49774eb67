"""Files written onto rigs, mappings that are kept, and refused rigs."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pygltflib
import pytest

from studio.engine.animation.clip.skeleton import to_file_axes
from studio.engine.animation.export import ExportOptions, clip, export
from studio.engine.animation.motion.bvh import read_bvh
from studio.engine.animation.read.gltf import read_gltf
from studio.engine.animation.read.gltf_file import GltfFile
from studio.engine.animation.retarget.facts import keep_rig, rig_facts
from studio.engine.animation.retarget.files import read_rig
from studio.engine.animation.retarget.mapping import guessed_bones, mapping_path, save_mapping
from studio.engine.animation.retarget.onto import export_onto, open_rig
from studio.engine.animation.retarget.transfer import retargeted
from studio.engine.base.errors import FormatError, SettingsError
from tests.engine.animation.retarget.performers import squatting
from tests.engine.animation.retarget.rigs import write_rig
from tests.engine.animation.retarget.test_transfer import places
from tests.poses_factory import t_pose
from tests.refused import refused


def under_an_armature(path: Path) -> None:
    """Put a GLB's skeleton under a node that is turned and scaled, as converters do; the rest pose stays in place."""
    tree = pygltflib.GLTF2().load(str(path))
    hips = tree.nodes[0]
    # from the armature: a quarter turn about x and a hundredth of the size
    x, y, z = hips.translation
    hips.translation = [100 * x, 100 * -z, 100 * y]
    hips.rotation = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
    for node in tree.nodes[1:]:
        if node.mesh is None:
            node.translation = [100 * v for v in node.translation]
    armature = pygltflib.Node(
        name="Armature", children=[0], scale=[0.01] * 3, rotation=[-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
    )
    tree.nodes.append(armature)
    tree.scenes[0].nodes = [len(tree.nodes) - 1, *tree.scenes[0].nodes[1:]]
    tree.save(str(path))


def test_a_glb_keeps_what_it_holds(tmp_path: Path) -> None:
    rig, out = tmp_path / "rig.glb", tmp_path / "out.glb"
    export(t_pose(2), rig, "glb")
    under_an_armature(rig)
    poses, options = squatting(), ExportOptions(take_name="Squats", interpolation="linear")
    onto = open_rig(rig)
    export_onto([(poses, options)], out, "glb", onto)
    before, after = GltfFile(rig), GltfFile(out)
    for name in ("meshes", "materials", "skins", "nodes", "scenes"):
        assert before.tree[name] == after.tree[name]
    for number in range(len(before.tree["accessors"])):
        assert np.array_equal(before.array(number), after.array(number))
    assert [animation["name"] for animation in after.tree["animations"]] == ["Squats"]
    read, wanted = read_gltf(out), places(clip(poses, options))
    for joint, name in enumerate(read.joint_names):
        assert np.abs(to_file_axes(read.positions_m[:, joint]) - wanted[name]).max() < 2e-5, name
    assert pygltflib.GLTF2().load(str(out)).animations[0].channels


@pytest.mark.parametrize(("kind", "format"), [("glb", "bvh"), ("bvh", "bvh"), ("bvh", "glb"), ("glb", "fbx")])
def test_files_hold_the_motion_on_the_rig(kind: str, format: str, tmp_path: Path) -> None:
    rig = write_rig(tmp_path / f"rig.{kind}", t_pose(2), "mixamo", "child", True)
    out, poses, onto = tmp_path / f"out.{format}", squatting(), open_rig(rig)
    export_onto([(poses, ExportOptions())], out, format, onto)
    wanted = retargeted(clip(poses, ExportOptions()), onto.mapping)
    again = read_rig(out)
    assert again.joint_names == wanted.joint_names
    if format == "bvh":
        read = read_bvh(out, unit_m=0.01 if kind == "glb" else onto.rig.unit_m)
        keep = [j for j, name in enumerate(read.joint_names) if not name.endswith(":end")]
        world = places(wanted)
        at = np.stack([world[r or n] for r, n in zip(wanted.roles, wanted.joint_names, strict=True)], axis=1)
        assert np.abs(to_file_axes(read.positions_m[:, keep]) - at).max() < 2e-4
    else:
        assert np.abs(again.positions_m - wanted.rest_positions_m).max() < 1e-5


def test_a_saved_mapping_is_used_again(tmp_path: Path) -> None:
    path = write_rig(tmp_path / "rig.glb", t_pose(2))
    rig = read_rig(path)
    bones = guessed_bones(rig)
    assert len(bones) == 52 and open_rig(path).source is None
    del bones["Head"]
    save_mapping(mapping_path(path), rig, bones)
    assert "Head" not in open_rig(path).mapping.joints and open_rig(path).source == mapping_path(path)
    other = tmp_path / "other.glb"
    other.write_bytes(write_rig(tmp_path / "child.glb", t_pose(2), "humanik", "child").read_bytes())
    assert open_rig(other).source == mapping_path(path)
    (tmp_path / "x").mkdir()
    elsewhere = write_rig(tmp_path / "x" / "rig.glb", t_pose(2), "vrm")
    mapping_path(elsewhere).write_bytes(mapping_path(path).read_bytes())
    with refused(FormatError, "rig.other_bones"):
        open_rig(elsewhere)
    keep_rig(path.read_bytes(), elsewhere)  # with the bones that the mapping there is meant for
    assert "Head" not in open_rig(elsewhere).mapping.joints


def test_facts_tell_what_to_correct(tmp_path: Path) -> None:
    path = write_rig(tmp_path / "rig.bvh", t_pose(2), "unreal", "child", True)
    facts = rig_facts(path)
    assert facts.problem is None and abs(facts.arms_below_t_pose_deg - 45) < 2
    assert facts.bones["LeftUpLeg"] == "thigh_l" and "thigh_twist_01_l" in facts.unmapped
    text = path.read_text().replace("pelvis", "bone_a").replace("root", "bone_b")
    path.write_text(text)
    facts = rig_facts(path)
    assert "hips" in facts.problem and facts.bones["LeftUpLeg"] == "thigh_l" and "bone_a" in facts.unmapped
    mapping_path(path).write_text(json.dumps({"bones": {**facts.bones, "Hips": "bone_a"}}))
    assert rig_facts(path).problem is None


@pytest.mark.parametrize(
    ("bones", "code"),
    [
        ({"Hips": "Hips", "Tail": "Head"}, "rig.no_role"),
        ({"Hips": "Hips", "Head": "tail"}, "rig.no_such_bone"),
        ({"Hips": "Hips", "Spine": "Hips"}, "rig.bone_used_twice"),
        ({"Hips": "Hips"}, "rig.bones_missing"),
        ({"Hips": 3}, "rig.bone_name"),
    ],
)
def test_wrong_mappings_are_refused(bones: dict[str, object], code: str, tmp_path: Path) -> None:
    rig, table = write_rig(tmp_path / "rig.glb", t_pose(2)), tmp_path / "table.json"
    table.write_text(json.dumps({"bones": bones}))
    with refused(FormatError, code):
        open_rig(rig, table)


def _tree(change: Callable[[dict[str, pygltflib.Node], pygltflib.GLTF2], None]) -> Callable[[Path], None]:
    def apply(path: Path) -> None:
        tree = pygltflib.GLTF2().load(str(path))
        change({node.name: node for node in tree.nodes}, tree)
        tree.save(str(path))

    return apply


def _renamed(*pairs: tuple[str, str]) -> Callable[[Path], None]:
    return _tree(lambda nodes, _: [setattr(nodes[old], "name", new) for old, new in pairs] and None)


def _many(nodes: dict[str, pygltflib.Node], tree: pygltflib.GLTF2) -> None:
    first = len(tree.nodes)
    tree.nodes += [pygltflib.Node(name=f"hair {k}") for k in range(10_000)]
    nodes["Head"].children += list(range(first, len(tree.nodes)))
    tree.skins = []


def _second_character(nodes: dict[str, pygltflib.Node], tree: pygltflib.GLTF2) -> None:
    tree.nodes.append(pygltflib.Node(name="Hips", children=[]))
    tree.scenes[0].nodes.append(len(tree.nodes) - 1)
    tree.skins = []


def _lying(nodes: dict[str, pygltflib.Node], tree: pygltflib.GLTF2) -> None:
    nodes["Hips"].rotation = [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
    tree.skins = []


BAD: dict[str, tuple[Callable[[Path], None], str]] = {
    "no hips": (_renamed(("Hips", "thing")), "rig.no_hips_bone"),
    "no legs": (_renamed(("LeftLeg", "a"), ("RightLeg", "b")), "rig.bones_missing"),
    "two hips": (_tree(_second_character), "rig.two_hips"),
    "cyclic": (_tree(lambda nodes, _: nodes["Head"].children.append(0)), "animation.damaged"),
    "no length": (_tree(lambda nodes, _: setattr(nodes["LeftFoot"], "translation", [0, 0, 0])), "rig.no_length"),
    "uneven": (_tree(lambda nodes, _: setattr(nodes["Spine"], "scale", [1, 2, 1])), "rig.scaled"),
    "nothing": (_tree(lambda nodes, _: setattr(nodes["Spine"], "scale", [0, 0, 0])), "rig.scaled_to_nothing"),
    "10,000 bones": (_tree(_many), "rig.bones"),
    "lying": (_tree(_lying), "rig.not_upright"),
    "cut off": (lambda path: path.write_bytes(path.read_bytes()[:500]) and None, "gltf.cut_off"),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD)
def test_bad_rigs_are_refused_and_nothing_is_written(kind: str, tmp_path: Path) -> None:
    change, code = BAD[kind]
    rig, out = write_rig(tmp_path / "rig.glb", t_pose(2)), tmp_path / "out.fbx"
    change(rig)
    with refused(FormatError, code):
        export_onto([(squatting(11), ExportOptions())], out, "fbx", open_rig(rig))
    assert not out.exists()


def test_what_a_rig_does_not_go_with(tmp_path: Path) -> None:
    onto = open_rig(write_rig(tmp_path / "rig.glb", t_pose(2)))
    for format, options, code in (
        ("c3d", ExportOptions(), "rig.points_format"),
        ("fbx", ExportOptions(target="unreal"), "rig.has_own_bones"),
        ("fbx", ExportOptions(mesh=True), "rig.has_own_body"),
    ):
        with refused(SettingsError, code):
            export_onto([(t_pose(3), options)], tmp_path / "out", format, onto)
    with refused(SettingsError, "rig.same_file"):
        export_onto([(t_pose(3), ExportOptions())], tmp_path / "rig.glb", "glb", onto)
    with refused(FormatError, "rig.ending"):
        open_rig(tmp_path / "rig.obj")
