"""Reader of a user's rig: the skeleton of a GLB, FBX or BVH file, with or without an animation."""

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.options import UNITS_M
from studio.engine.animation.clip.skeleton import to_file_axes
from studio.engine.animation.motion.bvh import read_bvh
from studio.engine.animation.motion.motion import END
from studio.engine.animation.read.apart import read_apart
from studio.engine.animation.read.gltf import node_order, own_transform, skin_joints
from studio.engine.animation.read.gltf_file import GltfFile
from studio.engine.animation.read.nodes import parent_among, unique_names, without_scale, world_matrices
from studio.engine.animation.retarget.rig import Array, Rig, check_scales, check_size
from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import quaternions
from studio.engine.model.roles import roles_of

RIG_ENDINGS = (".glb", ".gltf", ".fbx", ".bvh")
MAX_NODES = 20_000

_HEIGHT_M = 1.75
_FILE_STAGE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
_SAME_LENGTH = 0.02
_UPRIGHT_COSINE = 0.7


def read_rig(path: str | os.PathLike[str]) -> Rig:
    """Return the skeletons in a file in their rest pose: the bind pose of a mesh, else that of the nodes.

    Raises:
        FormatError: another ending; a file that is missing or damaged; no bones, more than 1024, or scaled ones.
        NotAvailableError: the file is an FBX, and the package ufbx is not installed.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in RIG_ENDINGS:
        raise FormatError(
            "rig.ending",
            "{path}: a rig ends in {kinds}; convert it to one of them",
            path=path,
            kinds=[*RIG_ENDINGS],
        )
    if kind == ".bvh":
        return _of_bvh(path)
    if kind == ".fbx":
        data = read_apart("fbx_rig_worker", path)
        own = (data["own_translations"], data["own_rotations_wxyz"], data["own_scales"])
        names = [str(name) for name in data["names"]]
        numbers = _depth_first(data["parents"])  # the reader sorts nodes by depth
        return _of_nodes(
            path, names, data["parents"], data["joints"], own, data["rest"], numbers, _FILE_STAGE
        )
    file = GltfFile(path)
    order, parents = node_order(file)
    translations, rotations, scales = (
        np.array([[own_transform(file, node, name) for node in order]])
        for name in ("translation", "rotation", "scale")
    )
    joints, rest = skin_joints(file, {node: k for k, node in enumerate(order)})
    names = [str(file.items("nodes")[node].get("name", f"node {node}")) for node in order]
    own = (translations, np.roll(rotations, 1, axis=-1), scales)
    return _of_nodes(path, names, parents, joints, own, rest, np.array(order), np.eye(3))


def _of_nodes(
    path: Path,
    names: list[str],
    parents: NDArray[np.int64],
    joints: NDArray[np.bool_],
    own: tuple[Array, Array, Array],
    bind: Array,
    numbers: NDArray[np.int64],
    turn: Array,
) -> Rig:
    """Return the rig of a scene's nodes; `turn` rotates the nodes' world to file axes."""
    if len(names) > MAX_NODES:
        raise FormatError(
            "rig.nodes",
            "{path} has {n} nodes; allowed are {most}; export the skeleton alone",
            path=path,
            n=len(names),
            most=MAX_NODES,
        )
    chosen = np.flatnonzero(joints) if joints.any() else np.arange(len(names))
    chosen = _in_file_order(chosen, parents, numbers)
    place = {int(node): k for k, node in enumerate(chosen)}
    above = np.array([parent_among(parents, place, int(node)) for node in chosen], dtype=np.int64)
    check_size(path, above)
    if not all(np.isfinite(part).all() for part in own) or (np.linalg.norm(own[1], axis=-1) < 1e-6).any():
        raise FormatError(
            "rig.not_finite", "{path}: a transform is not a finite number; export the file again", path=path
        )
    chosen_names = [names[k] for k in chosen]
    matrices = world_matrices(parents, *own, chosen)[0]
    check_scales(path, chosen_names, matrices)
    matrices = _bound(matrices, bind[chosen], above, chosen_names, turn)
    return Rig(
        path=path,
        joint_names=unique_names(chosen_names),
        parents=above,
        positions_m=matrices[:, :3, 3] @ turn.T,
        rotations_wxyz=quaternions(turn @ without_scale(matrices)),
        numbers=numbers[chosen],
    )


def _depth_first(parents: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return each node's index in depth-first order, shape (N,)."""
    children: dict[int, list[int]] = {}
    for node, parent in enumerate(parents.tolist()):
        children.setdefault(parent, []).append(node)
    places = np.zeros(len(parents), dtype=np.int64)
    stack, place = list(reversed(children.get(-1, []))), 0
    while stack:
        node = stack.pop()
        places[node], place = place, place + 1
        stack.extend(reversed(children.get(node, [])))
    return places


def _in_file_order(
    chosen: NDArray[np.int64], parents: NDArray[np.int64], numbers: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the nodes in the order of their numbers if that has parents before children, else unchanged."""
    ordered = chosen[np.argsort(numbers[chosen])]
    place = {int(node): k for k, node in enumerate(ordered)}
    above = [parent_among(parents, place, int(node)) for node in ordered]
    return ordered if all(parent < k for k, parent in enumerate(above)) else chosen


def _bound(own: Array, bind: Array, parents: NDArray[np.int64], names: list[str], turn: Array) -> Array:
    """Return the bind matrices of the skin, if they are of the same skeleton and upright; else `own`.

    A file may have been saved in the middle of a motion; then its bind pose is the rest pose. Bind matrices
    may also include a mesh's own place, unit or packing, and are then not usable.
    """
    if not np.isfinite(bind).all():
        return own
    rotations = without_scale(bind)
    if not np.isfinite(rotations).all() or np.linalg.det(rotations).min() < 0.9:
        return own
    below = np.flatnonzero(parents >= 0)
    lengths, bound = (np.linalg.norm(m[below, :3, 3] - m[parents[below], :3, 3], axis=1) for m in (own, bind))
    if (np.abs(bound - lengths) > _SAME_LENGTH * lengths + 1e-3).any():
        return own
    index = {role: k for k, role in enumerate(roles_of(names, parents.tolist())) if role}
    if "Hips" not in index or "Head" not in index:
        return own
    trunk = turn @ (bind[index["Head"], :3, 3] - bind[index["Hips"], :3, 3])
    return bind if trunk[1] > _UPRIGHT_COSINE * np.linalg.norm(trunk) else own


def _of_bvh(path: Path) -> Rig:
    motion = read_bvh(path, unit_m=1.0)
    keep = [joint for joint, name in enumerate(motion.joint_names) if not name.endswith(END)]
    place = {joint: k for k, joint in enumerate(keep)}
    parents = np.array([place.get(int(motion.parents[joint]), -1) for joint in keep], dtype=np.int64)
    check_size(path, parents)
    rest = to_file_axes(motion.rest_m)
    height = float(np.ptp(rest[:, 1]))
    if height <= 0:
        raise FormatError(
            "rig.no_height", "{path}: the rest pose has no height along y; export it with y up", path=path
        )
    unit = min(UNITS_M.values(), key=lambda unit_m: abs(np.log(unit_m * height / _HEIGHT_M)))
    return Rig(
        path=path,
        joint_names=tuple(motion.joint_names[joint] for joint in keep),
        parents=parents,
        positions_m=rest[keep] * unit,
        rotations_wxyz=np.tile([1.0, 0.0, 0.0, 0.0], (len(keep), 1)),
        numbers=np.array(keep),
        unit_m=unit,
    )
