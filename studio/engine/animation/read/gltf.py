"""Reader of the animation in a glTF file (.glb, or .gltf with embedded data): metres, y up."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from studio.engine.animation.motion.motion import Motion
from studio.engine.animation.read.apart import MAX_VALUES
from studio.engine.animation.read.gltf_file import GltfFile
from studio.engine.animation.read.nodes import Nodes, motion_of
from studio.engine.base.errors import FormatError
from studio.engine.base.sentences import say

Array = NDArray[np.float64]

_STAGE_FILE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_MAX_SECONDS = 4 * 3600.0
_RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0, 240.0)
_DEFAULTS = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}


def read_gltf(path: str | os.PathLike[str]) -> Motion:
    """Return the motion of the first animation, on the stage; its keys are sampled evenly at their usual rate.

    The rest pose is the bind pose of the skin, else that of the nodes.

    Raises:
        FormatError: the file is missing, damaged, refers to other files, has no animation, or no hips.
    """
    file = GltfFile(Path(path))
    order, parents = node_order(file)
    place = {node: k for k, node in enumerate(order)}
    own = {name: np.array([own_transform(file, node, name) for node in order]) for name in _DEFAULTS}
    animations = file.items("animations")
    if not animations or not isinstance(animations[0], dict):
        raise FormatError("gltf.no_animation", "{path} has no animation; export it with one", path=path)
    tracks = _tracks(file, animations[0], place)
    times = _times(file, tracks, len(order))
    moving = {name: np.repeat(values[None], len(times), axis=0) for name, values in own.items()}
    for (node, name), sampled in tracks.items():
        moving[name][:, node] = sampled[1](times)
    joints, rest = skin_joints(file, place)
    nodes = Nodes(
        names=tuple(str(file.items("nodes")[node].get("name", f"node {node}")) for node in order),
        parents=parents,
        joints=joints,
        translations=moving["translation"],
        rotations_wxyz=np.roll(moving["rotation"], 1, axis=-1),
        scales=moving["scale"],
        rest=rest,
        own=(own["translation"][None], np.roll(own["rotation"], 1, axis=-1)[None], own["scale"][None]),
        frame_s=float(times[1] - times[0]),
    )
    if not all(np.isfinite(values).all() for values in moving.values()):
        raise file.wrong(say("gltf.key", "a key is not a finite number"))
    if (np.linalg.norm(nodes.rotations_wxyz, axis=-1) < 1e-6).any():
        raise file.wrong(say("gltf.rotation", "a rotation is a quaternion of no length"))
    return motion_of(nodes, _STAGE_FILE, str(path))


def node_order(file: GltfFile) -> tuple[list[int], NDArray[np.int64]]:
    """Return the nodes, parents before children, and the index of each one's parent."""
    items = file.items("nodes")
    above = np.full(len(items), -1)
    for number, node in enumerate(items):
        if not isinstance(node, dict):
            raise file.wrong(say("gltf.no_node", "node {n} is none", n=number))
        for child in node.get("children", []):
            if not isinstance(child, int) or not 0 <= child < len(items) or above[child] >= 0:
                raise file.wrong(
                    say(
                        "gltf.child",
                        "node {n} has the child {child!r}, which is not there or has a parent",
                        n=number,
                        child=child,
                    )
                )
            above[child] = number
    order = [int(node) for node in np.flatnonzero(above < 0)]
    for node in order:  # grows during the loop
        order += items[node].get("children", [])
    if len(order) != len(items):
        raise file.wrong(say("gltf.circle", "nodes are each other's parents"))
    place = {node: k for k, node in enumerate(order)}
    return order, np.array([place.get(int(above[node]), -1) for node in order], dtype=np.int64)


def own_transform(file: GltfFile, node: int, name: str) -> tuple[float, ...]:
    """Return a node's own translation, rotation (xyzw) or scale."""
    value = file.items("nodes")[node]
    if "matrix" in value:
        matrix = _numbers(file, value["matrix"], 16).reshape(4, 4).T
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        if (scale < 1e-12).any():
            raise file.wrong(say("gltf.no_scale", "node {n} is scaled to nothing", n=node))
        parts = {
            "translation": matrix[:3, 3],
            "rotation": Rotation.from_matrix(matrix[:3, :3] / scale).as_quat(),
            "scale": scale,
        }
        return tuple(parts[name])
    default = _DEFAULTS[name]
    return tuple(_numbers(file, value.get(name, default), len(default)))


def _numbers(file: GltfFile, value: Any, count: int) -> Array:
    try:
        numbers = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise file.wrong(say("gltf.not_numbers", "a transform is not made of numbers")) from error
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise file.wrong(say("gltf.transform", "a transform needs {n} finite numbers", n=count))
    return numbers


_Track = tuple[Array, Callable[[Array], Array]]


def _tracks(
    file: GltfFile, animation: dict[str, Any], place: dict[int, int]
) -> dict[tuple[int, str], _Track]:
    """Return key times and samplers, by index of the node and animated property."""
    tracks: dict[tuple[int, str], _Track] = {}
    samplers = animation.get("samplers", [])
    for channel in animation.get("channels", []):
        target = channel.get("target", {})
        name, node, number = target.get("path"), target.get("node"), channel.get("sampler")
        if name not in _DEFAULTS or node not in place:
            continue  # weights of shapes, or a property of an extension
        if not isinstance(number, int) or not 0 <= number < len(samplers):
            raise file.wrong(
                say("gltf.no_sampler", "an animation has no sampler {sampler!r}", sampler=number)
            )
        sampler = samplers[number]
        times, values = file.array(sampler.get("input"))[:, 0], file.array(sampler.get("output"))
        kind = sampler.get("interpolation", "LINEAR")
        keys = 3 * len(times) if kind == "CUBICSPLINE" else len(times)
        if len(times) == 0 or values.shape != (keys, len(_DEFAULTS[name])) or not (np.diff(times) > 0).all():
            raise file.wrong(
                say(
                    "gltf.keys",
                    "the keys of node {n}'s {name} do not match their times, or those do not increase",
                    n=node,
                    name=name,
                )
            )
        if not (np.isfinite(times).all() and np.isfinite(values).all()):
            raise file.wrong(
                say("gltf.key_of", "a key of node {n}'s {name} is not a finite number", n=node, name=name)
            )
        tracks[place[node], name] = times, _sampler(times, values, kind, name == "rotation")
    return tracks


def _sampler(times: Array, values: Array, kind: str, turns: bool) -> Callable[[Array], Array]:
    """Return a function that samples the values at any times, by glTF 2.0's interpolations (appendix C)."""

    def sample(at: Array) -> Array:
        at = np.clip(at, times[0], times[-1])
        last = np.clip(np.searchsorted(times, at + 1e-9, side="right") - 1, 0, len(times) - 1)
        if kind == "STEP" or len(times) == 1:
            return values.reshape(len(times), -1, values.shape[1])[last, -1 if kind != "CUBICSPLINE" else 1]
        k = np.minimum(last, len(times) - 2)
        step = (times[k + 1] - times[k])[:, None]
        t = (at - times[k])[:, None] / step
        if kind == "LINEAR":
            return (
                Slerp(times, Rotation.from_quat(values))(at).as_quat()
                if turns
                else (1 - t) * values[k] + t * values[k + 1]
            )
        keys = values.reshape(len(times), 3, -1)
        return (
            (2 * t**3 - 3 * t**2 + 1) * keys[k, 1]
            + (t**3 - 2 * t**2 + t) * step * keys[k, 2]
            + (3 * t**2 - 2 * t**3) * keys[k + 1, 1]
            + (t**3 - t**2) * step * keys[k + 1, 0]
        )

    return sample


def _times(file: GltfFile, tracks: dict[tuple[int, str], _Track], node_count: int) -> Array:
    """Return even times over all keys at the common rate nearest to theirs."""
    if not tracks:
        raise FormatError(
            "gltf.no_moved_node",
            "{path}: its animation moves no node; export it with the skeleton's motion",
            path=file.path,
        )
    every = np.concatenate([times for times, _ in tracks.values()])
    begin, end = float(every.min()), float(every.max())
    if not 0.0 < end - begin <= _MAX_SECONDS:
        raise FormatError(
            "gltf.length",
            "{path}: an animation of {seconds:g} s; allowed is up to 4 h, and above 0",
            path=file.path,
            seconds=end - begin,
        )
    finest = min(float(np.median(np.diff(times))) for times, _ in tracks.values() if len(times) > 1)
    rate = min(_RATES, key=lambda usual: abs(np.log(usual * finest)))
    frames = int((end - begin) * rate + 1e-3) + 1
    if frames * node_count > MAX_VALUES:
        raise FormatError(
            "gltf.too_many_nodes",
            "{path}: {n} nodes over {frames} frames are too many",
            path=file.path,
            n=node_count,
            frames=frames,
        )
    return begin + np.arange(max(frames, 2)) / rate


def skin_joints(file: GltfFile, place: dict[int, int]) -> tuple[NDArray[np.bool_], Array]:
    """Return which nodes are joints of a skin, and the world matrices of their bind pose, NaN elsewhere."""
    joints, rest = np.zeros(len(place), dtype=bool), np.full((len(place), 4, 4), np.nan)
    for skin in file.items("skins"):
        nodes = skin.get("joints", []) if isinstance(skin, dict) else []
        if not all(node in place for node in nodes):
            raise file.wrong(say("gltf.skin_joint", "a skin has a joint that is no node"))
        columns = [place[node] for node in nodes]
        joints[columns] = True
        if "inverseBindMatrices" in skin:
            matrices = file.array(skin["inverseBindMatrices"])
            if matrices.shape != (len(columns), 16):
                raise file.wrong(
                    say("gltf.skin_matrices", "a skin has another number of bind matrices than of joints")
                )
            inverse = matrices.reshape(-1, 4, 4).transpose(0, 2, 1)
            solid = np.all(np.isfinite(inverse), axis=(1, 2))
            solid[solid] = np.abs(np.linalg.det(inverse[solid])) > 1e-12
            rest[np.array(columns)[solid]] = np.linalg.inv(inverse[solid])
    return joints, rest
