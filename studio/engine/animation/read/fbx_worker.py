"""Worker of `apart` that reads an FBX with ufbx: nodes with local transforms by frame, in stage axes and metres.

Every ufbx object is kept while it is used, because its wheel crashes on temporaries that are fetched again.
"""

from pathlib import Path
from typing import Any

import numpy as np

from studio.engine.animation.read.apart import MAX_VALUES, work
from studio.engine.base.errors import FormatError, NotAvailableError

_MAX_SECONDS = 4 * 3600.0


def read(path: Path) -> dict[str, Any]:
    """Return the arrays of `nodes.Nodes`."""
    scene = load_scene(path)
    import ufbx

    settings, stacks = scene.settings, list(scene.anim_stacks)
    nodes = list(scene.nodes)
    if not stacks:
        raise FormatError(
            "fbx.no_animation", "{path} has no animation; export it with its animation baked", path=path
        )
    stack = stacks[0]
    anim = stack.anim
    begin, length, rate = stack.time_begin, stack.time_end - stack.time_begin, settings.frames_per_second
    if not (0.0 <= length <= _MAX_SECONDS and 1.0 <= rate <= 1000.0):
        raise FormatError(
            "fbx.length",
            "{path}: an animation of {length:g} s at {rate:g} Hz; allowed: up to 4 h at 1 to 1000 Hz",
            path=path,
            length=length,
            rate=rate,
        )
    frames = int(length * rate + 1e-4) + 1
    if frames * len(nodes) > MAX_VALUES:
        raise FormatError(
            "fbx.too_many_nodes",
            "{path}: {n} nodes over {frames} frames are too many; export the skeleton alone",
            path=path,
            n=len(nodes),
            frames=frames,
        )
    moving = np.empty((frames, len(nodes), 10))
    for column, node in enumerate(nodes):
        for frame in range(frames):
            moving[frame, column] = transform_row(ufbx.evaluate_transform(anim, node, begin + frame / rate))
    own = np.array([[transform_row(node.local_transform) for node in nodes]])
    return {
        **tree_of(nodes),
        "rest": bind_matrices(scene, nodes),
        **transform_arrays("", moving),
        **transform_arrays("own_", own),
        "frame_s": np.array(1.0 / rate),
    }


def load_scene(path: Path) -> Any:
    """Return ufbx's scene of a file, in stage axes and metres.

    Raises:
        NotAvailableError: the package ufbx is not installed.
        FormatError: ufbx cannot read the file.
    """
    try:
        import ufbx
    except ImportError as error:
        raise NotAvailableError(
            "fbx.not_installed",
            "reading FBX needs the package ufbx: install capture-studio[fbx], or export the "
            "animation as BVH or GLB",
        ) from error
    try:
        return ufbx.load_file(str(path), target_axes=ufbx.axes_right_handed_z_up, target_unit_meters=1.0)
    except (RuntimeError, ValueError, OSError, MemoryError, ufbx.UfbxError) as error:
        reason = " ".join(str(error).split())[:200]
        raise FormatError(
            "fbx.unreadable",
            "{path} cannot be read as FBX: {error}; export it again",
            path=path,
            error=reason,
        ) from error


def tree_of(nodes: list[Any]) -> dict[str, Any]:
    parents, joints = [], []
    for node in nodes:
        parent, bone = node.parent, node.bone
        parents.append(-1 if parent is None else parent.typed_id)
        joints.append(bone is not None)
    return {
        "names": np.array([node.name for node in nodes]),
        "parents": np.array(parents, dtype=np.int64),
        "joints": np.array(joints, dtype=bool),
    }


def bind_matrices(scene: Any, nodes: list[Any]) -> np.ndarray:
    """World matrices of the bind pose, shape (N, 4, 4), NaN where it has none."""
    rest = np.full((len(nodes), 4, 4), np.nan)
    for pose in list(scene.poses):
        if not pose.is_bind_pose:
            continue
        for bone in list(pose.bone_poses):
            node, matrix = bone.bone_node, bone.bone_to_world
            rest[node.typed_id] = np.eye(4)
            rest[node.typed_id, :3] = np.array([matrix.c0, matrix.c1, matrix.c2, matrix.c3]).T
    return rest


def transform_row(transform: Any) -> tuple[float, ...]:
    t, r, s = transform.translation, transform.rotation, transform.scale
    return (t.x, t.y, t.z, r.w, r.x, r.y, r.z, s.x, s.y, s.z)


def transform_arrays(prefix: str, rows: np.ndarray) -> dict[str, np.ndarray]:
    return {
        f"{prefix}translations": rows[..., :3],
        f"{prefix}rotations_wxyz": rows[..., 3:7],
        f"{prefix}scales": rows[..., 7:],
    }


if __name__ == "__main__":
    work(read)
