"""From the nodes of a scene, with local transforms over time, to a skeleton's motion on the stage."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.motion.motion import Motion
from studio.engine.base.errors import FormatError
from studio.engine.model.roles import roles_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Nodes:
    """The nodes of a scene, parents before children, in any axes and unit.

    Attributes:
        names: shape (N,).
        parents: index of each node's parent, -1 for a root, shape (N,).
        joints: which nodes are bones in the file, shape (N,).
        translations, rotations_wxyz, scales: local, shapes (F, N, 3), (F, N, 4), (F, N, 3).
        rest: world matrices of the rest pose, shape (N, 4, 4); NaN where only the nodes' own are known.
        own: local transforms of the nodes without animation, as above but of one frame, shape (1, N, ...).
        frame_s: time between frames [s].
    """

    names: tuple[str, ...]
    parents: NDArray[np.int64]
    joints: NDArray[np.bool_]
    translations: Array
    rotations_wxyz: Array
    scales: Array
    rest: Array
    own: tuple[Array, Array, Array]
    frame_s: float


def motion_of(nodes: Nodes, T_stage_file: Array, what: str) -> Motion:
    """Return the motion of the skeleton that has hips, on the stage.

    Args:
        nodes: of the scene.
        T_stage_file: from the file's axes and unit to the stage's, shape (3, 3).
        what: the file, for messages.

    Raises:
        FormatError: there are no hips, or a value is not finite.
    """
    chosen = _chosen(nodes, what)
    world = world_matrices(nodes.parents, nodes.translations, nodes.rotations_wxyz, nodes.scales, chosen)
    rest = world_matrices(nodes.parents, *nodes.own, chosen)[0]
    known = np.isfinite(nodes.rest[chosen]).all(axis=(1, 2))
    if known.any():
        rest[known] = nodes.rest[chosen][known]
    if not (np.isfinite(world).all() and np.isfinite(rest).all()):
        raise FormatError(
            "rig.not_finite", "{path}: a transform is not a finite number; export the file again", path=what
        )
    turn = T_stage_file / np.cbrt(np.abs(np.linalg.det(T_stage_file)))
    place = {int(node): k for k, node in enumerate(chosen)}
    with np.errstate(invalid="ignore", divide="ignore"):
        rotations = turn @ without_scale(world) @ np.swapaxes(without_scale(rest), -1, -2) @ turn.T
    if not np.isfinite(rotations).all():
        raise FormatError(
            "animation.scaled_to_nothing",
            "{what}: a bone is scaled to nothing, so it has no direction; export it without",
            what=what,
        )
    return Motion(
        frame_s=nodes.frame_s,
        joint_names=unique_names([nodes.names[k] for k in chosen]),
        parents=np.array([parent_among(nodes.parents, place, int(node)) for node in chosen], dtype=np.int64),
        positions_m=world[..., :3, 3] @ T_stage_file.T,
        rotations=rotations,
        rest_m=rest[:, :3, 3] @ T_stage_file.T,
    )


def _chosen(nodes: Nodes, what: str) -> NDArray[np.int64]:
    """Return the joints of the tree that has hips: the file's bones, else every node of a tree."""
    candidates = np.flatnonzero(nodes.joints) if nodes.joints.any() else np.arange(len(nodes.names))
    place = {int(node): k for k, node in enumerate(candidates)}
    parents = [parent_among(nodes.parents, place, int(node)) for node in candidates]
    roles = roles_of([nodes.names[k] for k in candidates], parents)
    if "Hips" not in roles:
        raise FormatError(
            "animation.no_hips_joint",
            "{what}: no joint for the hips under any known name; it has {others}; rename its joints",
            what=what,
            others=", ".join(nodes.names[k] for k in candidates)[:300] or "no node",
        )
    root = roles.index("Hips")
    while parents[root] >= 0:
        root = parents[root]
    inside = np.zeros(len(candidates), dtype=bool)
    for k, parent in enumerate(parents):
        inside[k] = k == root or (parent >= 0 and inside[parent])
    return candidates[inside]


def parent_among(parents: NDArray[np.int64], place: dict[int, int], node: int) -> int:
    """Return the index of the nearest chosen ancestor, -1 where there is none."""
    above = int(parents[node])
    while above >= 0 and above not in place:
        above = int(parents[above])
    return place.get(above, -1)


def world_matrices(
    parents: NDArray[np.int64], t: Array, r_wxyz: Array, s: Array, wanted: NDArray[np.int64]
) -> Array:
    """Return world matrices of the wanted nodes, shape (F, len(wanted), 4, 4)."""
    needed = set()
    for node in wanted.tolist():
        while node >= 0 and node not in needed:
            needed.add(node)
            node = int(parents[node])
    frames = len(t)
    world: dict[int, Array] = {}
    for node in sorted(needed):
        local = np.zeros((frames, 4, 4))
        local[:, :3, :3] = (
            Rotation.from_quat(r_wxyz[:, node], scalar_first=True).as_matrix() * s[:, node, None]
        )
        local[:, :3, 3], local[:, 3, 3] = t[:, node], 1.0
        above = int(parents[node])
        world[node] = local if above < 0 else world[above] @ local
    return np.stack([world[int(node)] for node in wanted], axis=1)


def without_scale(world: Array) -> Array:
    """Return the rotations in world matrices, without their scales."""
    turned = world[..., :3, :3]
    return turned / np.linalg.norm(turned, axis=-2, keepdims=True)


def unique_names(names: list[str]) -> tuple[str, ...]:
    """Return names, with a number added to duplicates."""
    seen: dict[str, int] = {}
    out = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        out.append(name if seen[name] == 1 else f"{name}_{seen[name]}")
    return tuple(out)
