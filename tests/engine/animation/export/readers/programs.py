"""Animation files as other programs read them: the Autodesk FBX SDK, ufbx, Blender and bvhio.

Each reader returns a `ReadBack` in file axes (y up), centimetres; if a program is missing, the test is skipped.
"""

import json
import subprocess
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

TOOLS = Path(__file__).parents[5] / ".tools" / "readers"


@dataclass(frozen=True)
class ReadBack:
    """World poses that a program found: names and parents (-1 = none) of the joints, positions [cm], shape
    (sample_count, joint_count, 3), rotations, shape (sample_count, joint_count, 4), the rest positions [cm],
    and what else the program reports about the scene."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions_cm: NDArray[np.float64]
    rotations_wxyz: NDArray[np.float64]
    rest_cm: NDArray[np.float64]
    scene: dict[str, float]

    def in_order(self, names: tuple[str, ...]) -> "ReadBack":
        """Return the same with the joints in the order of `names`, which must be the joints' names."""
        assert sorted(names) == sorted(self.names)
        order = [self.names.index(name) for name in names]
        parent_names = [self.names[p] if p >= 0 else None for p in self.parents]
        return ReadBack(
            names=names,
            parents=tuple(-1 if parent_names[i] is None else names.index(parent_names[i]) for i in order),
            positions_cm=self.positions_cm[:, order],
            rotations_wxyz=self.rotations_wxyz[:, order],
            rest_cm=self.rest_cm[order],
            scene=self.scene,
        )


def read_with_ufbx(path: Path, *, hz: float, take: int = 0) -> ReadBack:
    """Return what ufbx samples from a take of the FBX file at `hz`; the scene says how many takes there are."""
    program = _program(TOOLS / "ufbx_joints")
    run = subprocess.run([program, path, str(hz), str(take)], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    lines = [line.split() for line in run.stdout.splitlines()]
    keys = (
        "unit_m",
        "up",
        "front",
        "frames_per_second",
        "begin_s",
        "end_s",
        "bind_bones",
        "cubic",
        "curves",
        "keys",
    )
    joints = [line for line in lines if line[0] == "joint"]
    values = np.array([line[1:] for line in lines if line[0] == "pose"], dtype=float).reshape(
        -1, len(joints), 7
    )
    scene = dict(zip(keys, map(float, lines[0][1:]), strict=True))
    scene["takes"] = sum(line[0] == "take" for line in lines)
    cm = scene["unit_m"] * 100.0
    return ReadBack(
        names=tuple(line[3] for line in joints),
        parents=tuple(int(line[1]) for line in joints),
        positions_cm=values[1:, :, :3] * cm,
        rotations_wxyz=values[1:, :, 3:],
        rest_cm=values[0, :, :3] * cm,
        scene=scene,
    )


def read_with_fbx_sdk(path: Path, *, hz: int) -> ReadBack:
    """Return what the Autodesk FBX SDK samples from the FBX file at 24, 30 or 60 Hz (through a GLB)."""
    program = _program(TOOLS / "node_modules" / "fbx2gltf" / "bin" / "Linux" / "FBX2glTF")
    glb = path.with_suffix(".sdk.glb")
    command = [program, "-b", "--anim-framerate", f"bake{hz}", "-i", path, "-o", glb.with_suffix("")]
    run = subprocess.run(command, capture_output=True, text=True, check=False, cwd=path.parent)
    assert run.returncode == 0, run.stdout + run.stderr
    return _read_glb(glb)


def _program(path: Path, name: str | None = None) -> Path:
    if not path.is_file():
        pytest.skip(f"{name or path.name} is not there; run tests/fetch_readers.sh")
    return path


def _read_glb(path: Path) -> ReadBack:
    """Return the nodes of a GLB except its root; all its baked channels have the same times."""
    data = path.read_bytes()
    json_size = int.from_bytes(data[12:16], "little")
    gltf = json.loads(data[20 : 20 + json_size])
    binary = data[28 + json_size :]

    def accessor(index: int) -> NDArray[np.float64]:
        item = gltf["accessors"][index]
        view = gltf["bufferViews"][item["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[item["type"]]
        start = view.get("byteOffset", 0) + item.get("byteOffset", 0)
        assert item["componentType"] == 5126
        values = np.frombuffer(binary, np.float32, item["count"] * width, start).astype(float)
        return values.reshape(-1, width)

    (animation,) = gltf["animations"]
    times = accessor(animation["samplers"][0]["input"])[:, 0]
    channels = {
        (c["target"]["node"], c["target"]["path"]): accessor(animation["samplers"][c["sampler"]]["output"])
        for c in animation["channels"]
    }
    nodes = gltf["nodes"]
    parent = {child: i for i, node in enumerate(nodes) for child in node.get("children", ())}
    joints = [i for i in range(len(nodes)) if i in parent and "mesh" not in nodes[i]]
    positions, rotations, rest, at_rest = {}, {}, {}, {}  # parents come first in what fbx2gltf writes
    for i, node in enumerate(nodes):
        shift = np.array(node.get("translation", [0.0, 0, 0])) * 100.0
        moves = channels.get((i, "translation"), shift[None] / 100.0) * 100.0
        turns = channels.get((i, "rotation"), np.array([node.get("rotation", [0.0, 0, 0, 1])]))
        assert node.get("scale", [1, 1, 1]) == pytest.approx([1, 1, 1])
        still = Rotation.from_quat(node.get("rotation", [0.0, 0, 0, 1]))
        own = Rotation.from_quat(np.repeat(turns, len(times) // len(turns), axis=0))
        moves = np.repeat(moves, len(times) // len(moves), axis=0)
        if i in parent:
            above = parent[i]
            positions[i] = positions[above] + rotations[above].apply(moves)
            rotations[i], rest[i] = rotations[above] * own, rest[above] + at_rest[above].apply(shift)
            at_rest[i] = at_rest[above] * still
        else:
            positions[i], rotations[i], rest[i], at_rest[i] = moves, own, shift, still
    return ReadBack(
        names=tuple(nodes[i]["name"] for i in joints),
        parents=tuple(joints.index(parent[i]) if parent[i] in joints else -1 for i in joints),
        positions_cm=np.stack([positions[i] for i in joints], axis=1),
        rotations_wxyz=np.stack([rotations[i].as_quat(scalar_first=True) for i in joints], axis=1),
        rest_cm=np.stack([rest[i] for i in joints]),
        scene={"end_s": float(times[-1])},
    )


def read_with_bvhio(path: Path) -> ReadBack:
    """Return what bvhio reads from the BVH file, frame by frame."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import bvhio

        container = bvhio.readAsBvh(str(path))
        root = bvhio.convertBvhToHierarchy(container.Root)
    joints = [joint for joint, _, _ in root.layout()]
    root.loadRestPose()  # bvhio turns each joint's axes along its bone: undo that
    along_bone = Rotation.from_quat([list(joint.RotationWorld) for joint in joints], scalar_first=True)
    positions, rotations = [], []
    for frame in range(container.FrameCount):
        root.loadPose(frame)
        positions.append([list(joint.PositionWorld) for joint in joints])
        world = Rotation.from_quat([list(joint.RotationWorld) for joint in joints], scalar_first=True)
        rotations.append((world * along_bone.inv()).as_quat(scalar_first=True))
    offsets = {joint.Name: np.array(list(joint.Offset)) for joint, _, _ in container.Root.layout()}
    parents = tuple(joints.index(joint.Parent) if joint.Parent else -1 for joint in joints)
    rest: list[NDArray[np.float64]] = []
    for joint, parent in zip(joints, parents, strict=True):
        rest.append(offsets[joint.Name] + (rest[parent] if parent >= 0 else 0.0))
    return ReadBack(
        names=tuple(joint.Name for joint in joints),
        parents=parents,
        positions_cm=np.array(positions),
        rotations_wxyz=np.array(rotations),
        rest_cm=np.array(rest),
        scene={"frames_per_second": 1.0 / container.FrameTime},
    )


def read_with_blender(jobs: dict[str, dict[str, Any]], folder: Path) -> dict[str, "BlenderScene"]:
    """Return what Blender reads from several FBX, BVH or GLB files, in one run of the program.

    Args:
        jobs: name -> `file`, `frames` (after the first, fractions allowed) and other keys of `blender_joints.py`.
        folder: for what the program writes.
    """
    program = _program(TOOLS / "blender" / "bin" / "python", "Blender (bpy)")
    given = [
        {**job, "file": str(job["file"]), "out": str(folder / f"{name}.npz")} for name, job in jobs.items()
    ]
    (folder / "jobs.json").write_text(json.dumps(given))
    command = [program, Path(__file__).with_name("blender_joints.py"), folder / "jobs.json"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout[-2000:] + run.stderr[-2000:]
    return {name: _blender_scene(folder / f"{name}.npz") for name in jobs}


@dataclass(frozen=True)
class BlenderScene:
    """Blender's result: bones, the names of the actions, and the mesh's vertices [cm] by frame or `rest`."""

    bones: ReadBack
    actions: tuple[str, ...]
    meshes_cm: dict[str, NDArray[np.float64]]


def _blender_scene(path: Path) -> BlenderScene:
    with np.load(path) as data:
        values = {key: data[key] for key in data.files}
    poses, rest = values["poses"], values["rest"]
    to_file = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    turns = to_file @ poses[..., :3, :3] / np.linalg.norm(poses[..., :3, 0], axis=-1)[..., None, None]
    rotations = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    bones = ReadBack(
        names=tuple(str(name) for name in values["names"]),
        parents=tuple(int(parent) for parent in values["parents"]),
        positions_cm=poses[..., :3, 3] @ to_file.T * 100.0,
        rotations_wxyz=rotations.reshape(*poses.shape[:2], 4),
        rest_cm=rest[:, :3, 3] @ to_file.T * 100.0,
        scene={"frames_per_second": float(values["fps"]), "unit_m": float(values["unit"])},
    )
    meshes = {key[5:]: values[key] @ to_file.T * 100.0 for key in values if key.startswith("mesh_")}
    return BlenderScene(bones, tuple(str(name) for name in values["actions"]), meshes)
