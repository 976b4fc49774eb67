"""GLB: read back by pygltflib, by three.js in Chromium and by Blender; valid, skinned, in metres."""

from dataclasses import replace

import numpy as np
import pygltflib
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation, Slerp

from studio.engine.animation.clip.kinematics import world_poses
from studio.engine.animation.clip.options import TARGETS
from studio.engine.animation.clip.skeleton import rotations_to_file_axes, to_file_axes
from studio.engine.animation.export import ExportOptions, clip, export
from studio.engine.animation.mannequin import mannequin
from studio.engine.base.errors import FormatError, SettingsError, StudioError
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from tests.engine.animation.export.readers.programs import read_with_blender
from tests.engine.animation.export.readers.three_page import open_in_three
from tests.engine.animation.export.scoring import HARD_MOTIONS
from tests.poses_factory import random_poses, t_pose
from tests.refused import refused
from tests.web.browser import quiet_page


def glb_pose(path, times_s):
    """World positions [m] and wxyz rotations by name at some times, and the document, read with pygltflib."""
    tree = pygltflib.GLTF2().load_binary(str(path))
    blob = tree.binary_blob()

    def values(number):
        accessor = tree.accessors[number]
        view = tree.bufferViews[accessor.bufferView]
        dtype = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[accessor.componentType]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[accessor.type]
        start = view.byteOffset + (accessor.byteOffset or 0)
        return np.frombuffer(blob, dtype, accessor.count * width, start).reshape(-1, width)

    tracks = {}
    animation = tree.animations[0]
    for channel in animation.channels:
        sampler = animation.samplers[channel.sampler]
        tracks[channel.target.node, channel.target.path] = (
            values(sampler.input)[:, 0].astype(float), values(sampler.output).astype(float), sampler.interpolation
        )  # fmt: skip
    world = {}

    def visit(node, above_p, above_r):
        own = tree.nodes[node]
        p = np.array(own.translation or [0.0, 0, 0])[None].repeat(len(times_s), 0)
        r = Rotation.from_quat(np.array(own.rotation or [0.0, 0, 0, 1])[None].repeat(len(times_s), 0))
        if (node, "translation") in tracks:
            p = sample(*tracks[node, "translation"], times_s)
        if (node, "rotation") in tracks:
            r = Rotation.from_quat(sample(*tracks[node, "rotation"], times_s))
        p, r = above_p + above_r.apply(p), above_r * r
        world[own.name] = p, r
        for child in own.children or []:
            visit(child, p, r)

    for root in tree.scenes[0].nodes:
        visit(root, np.zeros((len(times_s), 3)), Rotation.identity(len(times_s)))
    return world, tree, values


def sample(keys, values, kind, times_s):
    """Keys interpolated at some times by the rules of the glTF specification."""
    k = np.clip(np.searchsorted(keys, times_s, side="right") - 1, 0, max(len(keys) - 2, 0))
    if kind == "STEP" or len(keys) == 1:
        return values[np.clip(np.searchsorted(keys, times_s, side="right") - 1, 0, len(keys) - 1)]
    if kind == "LINEAR" and values.shape[1] == 4:
        return Slerp(keys, Rotation.from_quat(values))(np.minimum(times_s, keys[-1])).as_quat()
    step = (keys[k + 1] - keys[k])[:, None]
    t = (np.asarray(times_s) - keys[k])[:, None] / step
    if kind == "LINEAR":
        return (1 - t) * values[k] + t * values[k + 1]
    triple = values.reshape(-1, 3, values.shape[1])
    out = (2 * t**3 - 3 * t**2 + 1) * triple[k, 1] + (t**3 - 2 * t**2 + t) * step * triple[k, 2]
    return out + (3 * t**2 - 2 * t**3) * triple[k + 1, 1] + (t**3 - t**2) * step * triple[k + 1, 0]


def rotation_error_deg(found_wxyz, truth_wxyz):
    sign = np.sign((found_wxyz * truth_wxyz).sum(axis=-1, keepdims=True))
    chord = np.linalg.norm(found_wxyz * sign - truth_wxyz, axis=-1)
    return float(np.degrees(4 * np.arcsin(np.minimum(chord / 2, 1.0))).max())


@pytest.mark.parametrize("name", HARD_MOTIONS)
def test_pygltflib_reads_every_joint_where_it_is(tmp_path, name):
    poses = random_poses(np.random.default_rng(3), seconds=1.0, **HARD_MOTIONS[name])
    export(poses, tmp_path / "a.glb", "glb")
    world, _, _ = glb_pose(tmp_path / "a.glb", poses.time_s)
    truth, turned = to_file_axes(poses.positions_m), rotations_to_file_axes(poses.rotations_wxyz)
    for joint, joint_name in enumerate(poses.joint_names):
        p, r = world[joint_name]
        assert np.abs(p - truth[:, joint]).max() < 5e-4
        assert rotation_error_deg(r.as_quat(scalar_first=True), turned[:, joint]) < 0.05


def between_keys_cm(tmp_path, interpolation):
    """Mean and worst error between the 30 Hz keys of a 120 Hz clip."""
    fine = random_poses(np.random.default_rng(4), seconds=3.0, hz=120.0, angle_sd_rad=0.4)
    export(fine, tmp_path / "b.glb", "glb", fps=30.0, interpolation=interpolation, mesh=False)
    inside = slice(8, -8)
    world, _, _ = glb_pose(tmp_path / "b.glb", fine.time_s[inside])
    truth = to_file_axes(fine.positions_m)[inside]
    errors = [np.linalg.norm(world[n][0] - truth[:, j], axis=1) for j, n in enumerate(fine.joint_names)]
    return 100 * np.mean(errors), 100 * np.max(errors)


def test_cubic_keys_follow_the_motion_between_them(tmp_path):
    cubic, linear = between_keys_cm(tmp_path, "cubic"), between_keys_cm(tmp_path, "linear")
    assert cubic[0] < 0.1 and cubic[1] < 0.5
    assert linear[0] > 3 * cubic[0]
    assert between_keys_cm(tmp_path, "constant")[0] > linear[0]


def test_the_body_is_skinned_in_two_materials_and_named(tmp_path):
    export(t_pose(3), tmp_path / "c.glb", "glb", take_name="Walk 1")
    _, tree, values = glb_pose(tmp_path / "c.glb", np.zeros(1))
    assert tree.animations[0].name == "Walk 1" and tree.asset.version == "2.0"
    assert [m.name for m in tree.materials] == ["Body", "Joints"]
    assert tree.nodes[-1].skin == 0 and len(tree.skins[0].joints) == 52
    primitive = tree.meshes[0].primitives[0]
    assert np.allclose(values(primitive.attributes.WEIGHTS_0).sum(axis=1), 1.0, atol=1e-6)
    binds = values(tree.skins[0].inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
    motion = clip(t_pose(3), ExportOptions())
    rest = np.concatenate([motion.rest_positions_m, np.ones((52, 1))], axis=1)
    assert np.allclose(np.einsum("jab,jb->ja", binds, rest), [0, 0, 0, 1], atol=1e-6)


def test_without_a_mesh_and_with_one_frame(tmp_path):
    export(t_pose(1), tmp_path / "d.glb", "glb", mesh=False)
    world, tree, _ = glb_pose(tmp_path / "d.glb", np.zeros(1))
    assert not tree.meshes and len(world) == 52
    assert world["Hips"][0][0, 1] == pytest.approx(0.94, abs=1e-4)


def test_three_js_shows_it_as_it_is(tmp_path, chromium):
    poses = random_poses(np.random.default_rng(5), seconds=1.0, turns_per_s=0.5)
    export(poses, tmp_path / "e.glb", "glb", take_name="Turn")
    frames = np.array([0, 7, 30, 59])
    with quiet_page(chromium) as page:
        file = open_in_three(page, tmp_path / "e.glb")
        assert file.about["clip"] == "Turn" and file.about["skinned"] == 2
        assert file.about["duration"] == pytest.approx(1.0, abs=1e-4)
        found = file.joints(OUTPUT_JOINTS, poses.time_s[frames])
        picture = file.picture(0.5, eye_m=[1.5, 1.4, 3.5], at_m=[0, 0.9, 0])
    truth = to_file_axes(poses.positions_m)[frames]
    assert np.linalg.norm(found[..., :3] - truth, axis=-1).max() < 5e-4
    assert rotation_error_deg(found[..., 3:], rotations_to_file_axes(poses.rotations_wxyz)[frames]) < 0.05
    (tmp_path / "e.png").write_bytes(picture)
    assert len(picture) > 20_000  # not an empty scene


@pytest.mark.parametrize("root_motion", ["hips", "root"])
@pytest.mark.parametrize("target", TARGETS)
def test_every_target_has_its_joints_where_they_are(tmp_path, target, root_motion):
    poses = random_poses(np.random.default_rng(6), seconds=0.5, turns_per_s=0.3)
    options = ExportOptions(target=target, root_motion=root_motion)
    export(poses, tmp_path / "t.glb", "glb", options)
    world, tree, _ = glb_pose(tmp_path / "t.glb", poses.time_s)
    motion = clip(poses, options)
    assert [node.name for node in tree.nodes[:-1]] == list(motion.joint_names)
    truth = to_file_axes(poses.positions_m)
    known = [(name, role) for name, role in zip(motion.joint_names, motion.roles, strict=True) if role]
    assert len(known) >= 50
    for name, role in known:
        assert np.abs(world[name][0] - truth[:, OUTPUT_INDEX[role]]).max() < 5e-4, name


def test_blender_reads_bones_and_body_where_they_are(tmp_path):
    poses = random_poses(np.random.default_rng(8), seconds=1.0, angle_sd_rad=0.3)
    frames = [0, 13, 30, 60]
    at_24 = [
        poses.time_s[k] * 24.0 for k in frames
    ]  # Blender counts a GLB's seconds in the scene's 24 frames
    jobs = {}
    for target in ("humanik", "unreal"):
        export(poses, tmp_path / f"{target}.glb", "glb", target=target, take_name="Dance")
        jobs[target] = {"file": tmp_path / f"{target}.glb", "frames": at_24}
    scenes = read_with_blender(jobs, tmp_path)
    truth = to_file_axes(poses.positions_m)[frames] * 100.0
    for target, scene in scenes.items():
        motion = clip(poses, ExportOptions(target=target))
        assert any("Dance" in action for action in scene.actions)
        for name, role in zip(motion.joint_names, motion.roles, strict=True):
            if role:
                found = scene.bones.positions_cm[:, scene.bones.names.index(name)]
                assert np.linalg.norm(found - truth[:, OUTPUT_INDEX[role]], axis=1).max() < 0.05, (
                    target,
                    name,
                )
        assert body_error_cm(motion, poses, frames[-1], scene.meshes_cm["3"]) < 0.05
        assert body_error_cm(motion, None, 0, scene.meshes_cm["rest"]) < 0.05


def body_error_cm(motion, poses, frame, vertices_cm):
    """Largest distance of a vertex in Blender from the mannequin's vertices, in a frame or at rest."""
    mesh, rest = mannequin(motion), motion.rest_positions_m
    positions, rotations = rest, np.tile(np.eye(3), (len(rest), 1, 1))
    if poses is not None:
        offsets = motion.local_positions_m()
        positions, turned = world_poses(motion.parents, offsets, motion.rotations_wxyz)
        at_rest = Rotation.from_quat(motion.rest_rotations_wxyz, scalar_first=True)
        positions = positions[frame]
        rotations = (Rotation.from_quat(turned[frame], scalar_first=True) * at_rest.inv()).as_matrix()
    truth = mesh.posed(rest, positions, rotations) * 100.0
    return cKDTree(truth).query(vertices_cm)[0].max()


def test_a_rig_without_a_limb_gives_one_error_and_no_file(tmp_path):
    poses = t_pose(2)
    names = tuple("X" if n == "LeftArm" else n for n in poses.joint_names)
    with refused(FormatError, "export.mesh_lacks", names=["LeftArm"]):
        export(replace(poses, joint_names=names), tmp_path / "f.glb", "glb")
    assert list(tmp_path.iterdir()) == []


def test_poses_that_are_not_finite_and_a_place_that_cannot_be_written(tmp_path):
    poses = t_pose(2)
    poses.positions_m[1, 3] = np.nan
    with pytest.raises(FormatError):
        export(poses, tmp_path / "g.glb", "glb")
    (tmp_path / "file").write_text("")
    with refused(StudioError, "file.unwritable_place"):
        export(t_pose(2), tmp_path / "file" / "g.glb", "glb")
    with refused(SettingsError, "export.not_for_format", name="unit"):
        export(t_pose(2), tmp_path / "g.glb", "glb", unit="m")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
