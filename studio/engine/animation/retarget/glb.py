"""Writes a motion onto a user's own GLB: the file is kept, and the take replaces its animations.

Meshes, materials, textures, skins and all nodes stay byte for byte; keys are added behind the file's own buffer. Keys
are local to each bone's node, also under nodes that are no bones (an armature with its own scale and rotation).
"""

import json
import os
import struct
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.kinematics import world_poses
from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.export.glb import GltfDocument
from studio.engine.animation.read.gltf import node_order, own_transform
from studio.engine.animation.read.gltf_file import GltfFile
from studio.engine.animation.read.nodes import without_scale, world_matrices
from studio.engine.animation.retarget.rig import Rig
from studio.engine.base.errors import FormatError
from studio.engine.base.files import write_atomically
from studio.engine.base.geometry import quaternions
from studio.engine.base.quaternions import continuous_signs, inverse, multiply, rotate

Array = NDArray[np.float64]

_STILL_M = 1e-5
"""A bone needs no position keys if its position in its parent's node stays this close to the file's."""

_ALIGNED = 8
_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942


def write_onto_glb(
    motion: LocalMotion, rig: Rig, path: str | os.PathLike[str], options: ExportOptions
) -> None:
    """Write the rig's file with the motion as its one animation, atomically.

    Args:
        motion: on all bones of the rig, in their order.
        rig: of a glTF file.
        path: of the new file.
        options: `interpolation` is used.

    Raises:
        FormatError: the file cannot be read again, or has compressed buffers that cannot be merged.
        StudioError: the file cannot be written.
    """
    file = GltfFile(rig.path)
    keys = _of_nodes(motion, rig, file)
    document = GltfDocument()
    numbers = rig.numbers.tolist()
    document.add_animation(keys, options.interpolation, numbers)
    tree, data = _merged(file, document)
    for number in numbers:
        if "matrix" in tree["nodes"][number]:  # an animated node must not have a matrix
            parts = {
                name: list(own_transform(file, number, name)) for name in ("translation", "rotation", "scale")
            }
            tree["nodes"][number] = {k: v for k, v in tree["nodes"][number].items() if k != "matrix"} | parts
    text = json.dumps(tree, ensure_ascii=False, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    with write_atomically(path) as out:
        out.write(struct.pack("<III", _MAGIC, 2, 28 + len(text) + len(data)))
        out.write(struct.pack("<II", len(text), _JSON) + text + struct.pack("<II", len(data), _BIN))
        out.write(data)


def _of_nodes(motion: LocalMotion, rig: Rig, file: GltfFile) -> LocalMotion:
    """Return the motion with keys in the axes and units of the bones' parent nodes in the file."""
    order, parents = node_order(file)
    place = {node: k for k, node in enumerate(order)}
    translations, rotations, scales = (
        np.array([[own_transform(file, node, name) for node in order]])
        for name in ("translation", "rotation", "scale")
    )
    rotations = np.roll(rotations, 1, axis=-1)
    matrices = world_matrices(parents, translations, rotations, scales, np.arange(len(order)))[0]
    sizes = np.linalg.norm(matrices[:, :3, 0], axis=1)
    at = [place[number] for number in rig.numbers.tolist()]
    carriers = []
    for joint, node in enumerate(at):
        above, bone = int(parents[node]), int(rig.parents[joint])
        if above < 0:
            carriers.append(None)
            continue
        start = np.eye(4) if bone < 0 else matrices[at[bone]]
        relative = np.linalg.inv(start) @ matrices[above]
        turn = quaternions(without_scale(relative[None]))[0]
        size = 1.0 if bone < 0 else sizes[at[bone]]
        carriers.append((bone, size * relative[:3, 3], turn, sizes[above]))
    stay = translations[0][at]
    return _keys(motion, carriers, stay)


def _keys(
    motion: LocalMotion, carriers: list[tuple[int, Array, Array, float] | None], stay: Array
) -> LocalMotion:
    """Return keys local to each bone's parent node: (bone above or -1, offset [m] and rotation from there, scale)."""
    positions, rotations = world_poses(motion.parents, motion.local_positions_m(), motion.rotations_wxyz)
    places, local = positions.copy(), rotations.copy()
    moved = {}
    for joint, carrier in enumerate(carriers):
        if carrier is not None:
            bone, arm, turn, size = carrier
            whole, start = (
                (turn[None], arm[None])
                if bone < 0
                else (
                    multiply(rotations[:, bone], turn),
                    positions[:, bone] + rotate(rotations[:, bone], arm),
                )
            )
            places[:, joint] = rotate(inverse(whole), positions[:, joint] - start) / size
            local[:, joint] = multiply(inverse(whole), rotations[:, joint])
        else:
            size = 1.0
        if np.abs(places[:, joint] - stay[joint]).max() * size > _STILL_M:
            moved[joint] = places[:, joint]
    between = None if motion.between is None else _keys(motion.between, carriers, stay)
    return replace(motion, positions_m=moved, rotations_wxyz=continuous_signs(local), between=between)


def _merged(file: GltfFile, document: GltfDocument) -> tuple[dict[str, Any], bytes]:
    """Return the file's tree with the document's animation in place of its own, and all data as one buffer."""
    tree, data = dict(file.tree), bytearray()
    starts = []
    for buffer in file.buffers:
        starts.append(len(data))
        data += buffer + bytes(-len(buffer) % _ALIGNED)
    views = [dict(view) for view in file.items("bufferViews")]
    for view in views:
        if len(starts) > 1 and "extensions" in view:
            raise FormatError(
                "rig.several_buffers",
                "{path} has compressed data in several buffers; export it as one .glb file",
                path=file.path,
            )
        view["byteOffset"] = view.get("byteOffset", 0) + starts[view.get("buffer", 0)]
        view["buffer"] = 0
    accessors = list(file.items("accessors"))
    added = json.loads(document.tree.to_json())
    base = len(data)
    for accessor in added["accessors"]:
        accessors.append(_present(accessor) | {"bufferView": accessor["bufferView"] + len(views)})
    for view in added["bufferViews"]:
        view = {"buffer": 0, "byteOffset": view["byteOffset"] + base, "byteLength": view["byteLength"]}
        views.append(view)
    data += b"".join(document.pieces)
    data += bytes(-len(data) % 4)
    (animation,) = added["animations"]
    first = len(file.items("accessors"))
    samplers = [
        {
            "input": one["input"] + first,
            "output": one["output"] + first,
            "interpolation": one["interpolation"],
        }
        for one in animation["samplers"]
    ]
    channels = [
        {"sampler": one["sampler"], "target": {"node": one["target"]["node"], "path": one["target"]["path"]}}
        for one in animation["channels"]
    ]
    tree["animations"] = [{"name": animation["name"], "samplers": samplers, "channels": channels}]
    tree["accessors"], tree["bufferViews"] = accessors, views
    tree["buffers"] = [{"byteLength": len(data)}]
    return tree, bytes(data)


def _present(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}
