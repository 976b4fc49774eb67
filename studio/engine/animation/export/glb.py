"""GLB: glTF 2.0 in one binary file: the skeleton, its skin with the mannequin, and one animation. A scene of several
performers has a node for each, with their skeleton and body below it.

Metres, y up, facing +z, as in glTF. Rotations are converted to xyzw here and nowhere else. Cubic keys have
the slopes of `curves`.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pygltflib as gltf
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.curves.keys import curve_keys, frame_slopes
from studio.engine.animation.mannequin import SEAM, SkinnedMesh, mannequin
from studio.engine.base.files import write_atomically

_INTERPOLATIONS = {"cubic": "CUBICSPLINE", "linear": "LINEAR", "constant": "STEP"}
_TYPES = {1: gltf.SCALAR, 3: gltf.VEC3, 4: gltf.VEC4, 16: gltf.MAT4}
_COMPONENTS = {
    "float32": gltf.FLOAT,
    "int16": gltf.SHORT,
    "uint16": gltf.UNSIGNED_SHORT,
    "uint32": gltf.UNSIGNED_INT,
}
_UNITS = {"translation": 100.0, "rotation": float(np.degrees(2.0))}
"""Factors from keys to the cm and degrees of `curves`; a quaternion's component changes by half of a small turn."""

_BODY_RGBA, _SEAM_RGBA = [0.72, 0.70, 0.66, 1.0], [0.16, 0.18, 0.22, 1.0]


def write_glb(motion: LocalMotion, path: str | os.PathLike[str], options: ExportOptions) -> None:
    """Write the motion as a GLB file, atomically; with the mannequin unless `options.mesh` is False.

    Raises:
        FormatError: no body fits the skeleton.
        StudioError: the file cannot be written.
    """
    document = GltfDocument()
    document.add_skeleton(motion)
    if options.mesh is not False:
        document.add_mesh(mannequin(motion))
    document.add_animation(motion, options.interpolation)
    with write_atomically(path) as file:
        for piece in document.finished():
            file.write(piece)


def write_glb_scene(
    performers: Sequence[tuple[str, LocalMotion]], path: str | os.PathLike[str], options: ExportOptions
) -> None:
    """Write several performers, by name, as one GLB file, atomically; else as `write_glb`."""
    document = GltfDocument()
    for name, motion in performers:
        mesh = None if options.mesh is False else mannequin(motion)
        document.add_performer(name, motion, mesh, options.interpolation)
    document.name_animation(options.take_name)
    with write_atomically(path) as file:
        for piece in document.finished():
            file.write(piece)


@dataclass
class GltfDocument:
    """A glTF document and its buffer, while they are built.

    `packed`: linear rotations as 16-bit numbers with a resolution of 0.003 degrees, in half the space.
    """

    tree: gltf.GLTF2 = field(default_factory=lambda: gltf.GLTF2())
    pieces: list[bytes] = field(default_factory=list)
    length: int = 0
    packed: bool = False

    def add(self, values: NDArray[np.generic], *, target: int | None = None, bounds: bool = False) -> int:
        """Add an array, shape (N,) or (N, components), to the buffer; return its accessor. Signed 16-bit integers are
        normalised to -1..1.
        """
        flat = np.ascontiguousarray(values).reshape(len(values), -1)
        data = flat.tobytes()
        self.tree.bufferViews.append(
            gltf.BufferView(buffer=0, byteOffset=self.length, byteLength=len(data), target=target)
        )
        padding = -len(data) % 4
        self.pieces += [data, bytes(padding)]
        self.length += len(data) + padding
        self.tree.accessors.append(
            gltf.Accessor(
                bufferView=len(self.tree.bufferViews) - 1,
                componentType=_COMPONENTS[flat.dtype.name],
                count=len(flat),
                normalized=True if flat.dtype == np.int16 else None,
                type=_TYPES[flat.shape[1]],
                min=flat.min(axis=0).tolist() if bounds else None,
                max=flat.max(axis=0).tolist() if bounds else None,
            )
        )
        return len(self.tree.accessors) - 1

    def add_performer(
        self,
        name: str,
        motion: LocalMotion,
        mesh: SkinnedMesh | None,
        interpolation: str,
        body_rgba: Sequence[float] = _BODY_RGBA,
    ) -> None:
        """Add one of several performers: a node of their name with skeleton and body, and their keys, in the same
        animation as the others'."""
        joints = self.add_skeleton(motion)
        below = [joints[0]]
        if mesh is not None:
            below.append(self.add_mesh(mesh, body_rgba))
        scene = self.tree.scenes[0]
        top = [node for node in scene.nodes or () if node not in below]
        self.tree.nodes.append(gltf.Node(name=name, children=below, extras=_extras(motion)))
        scene.nodes = [*top, len(self.tree.nodes) - 1]
        before = list(self.tree.animations)
        self.add_animation(motion, interpolation, joints)
        if before:
            _append(before[0], self.tree.animations[0])
            self.tree.animations = before

    def name_animation(self, name: str) -> None:
        """Name the one animation."""
        self.tree.animations[0].name = name
        self.tree.animations[0].extras = {}  # each performer's node has its own

    def add_skeleton(self, motion: LocalMotion) -> list[int]:
        """Add a node per joint, in the order of the motion, and the skin that binds them; return the nodes."""
        base = len(self.tree.nodes)
        children: list[list[int]] = [[] for _ in motion.parents]
        for joint, parent in enumerate(motion.parents.tolist()):
            if parent >= 0:
                children[parent].append(base + joint)
        rest = motion.rest_local_wxyz
        self.tree.nodes += [
            gltf.Node(
                name=name,
                translation=motion.offsets_m[joint].tolist(),
                rotation=np.roll(rest[joint], -1).tolist(),
                children=children[joint],
            )
            for joint, name in enumerate(motion.joint_names)
        ]
        self._to_scene(base)
        binds = self.add(_inverse_binds(motion))
        joints = list(range(base, base + len(motion.parents)))
        self.tree.skins.append(
            gltf.Skin(name="Skeleton", skeleton=base, joints=joints, inverseBindMatrices=binds)
        )
        return joints

    def _to_scene(self, node: int) -> None:
        if not self.tree.scenes:
            self.tree.scenes, self.tree.scene = [gltf.Scene(nodes=[])], 0
        scene = self.tree.scenes[0]
        scene.nodes = [*(scene.nodes or ()), node]

    def add_mesh(self, mesh: SkinnedMesh, body_rgba: Sequence[float] = _BODY_RGBA) -> int:
        """Add the body of the last skeleton on its own node, with a material per tone; return the node."""
        attributes = gltf.Attributes(
            POSITION=self.add(mesh.vertices_m, target=gltf.ARRAY_BUFFER, bounds=True),
            NORMAL=self.add(mesh.normals, target=gltf.ARRAY_BUFFER),
            JOINTS_0=self.add(mesh.joint_indices, target=gltf.ARRAY_BUFFER),
            WEIGHTS_0=self.add(mesh.weights, target=gltf.ARRAY_BUFFER),
        )
        primitives = []
        for tone, (name, colour) in enumerate((("Body", [*body_rgba]), ("Joints", _SEAM_RGBA))):
            corners = mesh.triangles[mesh.tones == tone].ravel()
            roughness = 0.6 if tone == SEAM else 0.75
            surface = gltf.PbrMetallicRoughness(
                baseColorFactor=colour, metallicFactor=0.0, roughnessFactor=roughness
            )
            self.tree.materials.append(
                gltf.Material(name=name, pbrMetallicRoughness=surface, alphaCutoff=None)
            )
            indices = self.add(corners, target=gltf.ELEMENT_ARRAY_BUFFER)
            material = len(self.tree.materials) - 1
            primitives.append(gltf.Primitive(attributes=attributes, indices=indices, material=material))
        self.tree.meshes.append(gltf.Mesh(name="Mannequin", primitives=primitives))
        skin, own = len(self.tree.skins) - 1, len(self.tree.meshes) - 1
        self.tree.nodes.append(gltf.Node(name="Mannequin", mesh=own, skin=skin))
        self._to_scene(len(self.tree.nodes) - 1)
        return len(self.tree.nodes) - 1

    def add_animation(
        self, motion: LocalMotion, interpolation: str, nodes: Sequence[int] | None = None
    ) -> None:
        """Add the keys: rotations of every joint, positions of those that have position keys.

        Args:
            motion: the keys.
            interpolation: one of `INTERPOLATIONS`.
            nodes: number of each joint's node; None = the joints' own order.
        """
        times = np.arange(motion.frame_count) / motion.frames_per_second
        kind = _INTERPOLATIONS[interpolation] if len(times) > 1 else "STEP"
        clock = self.add(times.astype(np.float32), bounds=True)
        animation = gltf.Animation(name=motion.name, extras=_extras(motion))
        self.tree.animations = [animation]

        def channel(
            joint: int, path: str, keys: NDArray[np.float64], dense: NDArray[np.float64] | None
        ) -> None:
            if kind == "CUBICSPLINE":
                keys = _with_slopes(keys, dense, motion.frames_per_second, _UNITS[path])
            if self.packed and path == "rotation" and kind != "CUBICSPLINE":
                output = self.add(np.rint(keys * 32767.0).astype(np.int16))
            else:
                output = self.add(keys.astype(np.float32))
            animation.samplers.append(gltf.AnimationSampler(input=clock, output=output, interpolation=kind))
            node = joint if nodes is None else nodes[joint]
            target = gltf.AnimationChannelTarget(node=node, path=path)
            animation.channels.append(
                gltf.AnimationChannel(sampler=len(animation.samplers) - 1, target=target)
            )

        dense = motion.between
        for joint in range(len(motion.parents)):
            if joint in motion.positions_m:
                finer = None if dense is None else dense.positions_m.get(joint)
                channel(joint, "translation", motion.positions_m[joint], finer)
            finer = None if dense is None else _xyzw(dense.rotations_wxyz[:, joint])
            channel(joint, "rotation", _xyzw(motion.rotations_wxyz[:, joint]), finer)

    def finished(self) -> list[bytes]:
        """Return the parts of the file in order."""
        self.tree.asset = gltf.Asset(version="2.0", generator="Capture Studio")
        self.tree.buffers = [gltf.Buffer(byteLength=self.length)]
        self.tree.set_binary_blob(b"".join(self.pieces))
        return self.tree.save_to_bytes()


def _extras(motion: LocalMotion) -> dict[str, list[list[float]]]:
    """Return data that glTF has no place for: undecided spans [s]."""
    return {} if motion.undecided_s is None else {"undecided_s": [list(span) for span in motion.undecided_s]}


def _append(animation: gltf.Animation, more: gltf.Animation) -> None:
    """Add an animation's channels to another."""
    for channel in more.channels:
        channel.sampler = (channel.sampler or 0) + len(animation.samplers)
    animation.samplers += more.samplers
    animation.channels += more.channels


def _xyzw(rotations_wxyz: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.roll(rotations_wxyz, -1, axis=-1)


def _with_slopes(
    keys: NDArray[np.float64], between: NDArray[np.float64] | None, frames_per_second: float, unit: float
) -> NDArray[np.float64]:
    """Return in-slope, value and out-slope of each key, row by row, shape (3 * frame_count, width).

    Slopes are those of the FBX curves: central differences, limited beside jumps, fitted to the motion between keys.
    """
    out = np.empty((len(keys), 3, keys.shape[1]))
    out[:, 1] = keys
    for k in range(keys.shape[1]):
        finer = None if between is None else between[:, k] * unit
        curve = curve_keys(keys[:, k] * unit, frames_per_second, "cubic", between=finer)
        usual = (frame_slopes if len(keys) > 2 else np.gradient)(keys[:, k]) * frames_per_second
        out[:, 0, k] = np.where(np.isnan(curve.lefts), usual, curve.lefts / unit)
        out[:, 2, k] = np.where(np.isnan(curve.slopes), usual, curve.slopes / unit)
    return out.reshape(-1, keys.shape[1])


def _inverse_binds(motion: LocalMotion) -> NDArray[np.float32]:
    """Matrices from the rest pose to each joint's axes, column by column, shape (joint_count, 16)."""
    turns = Rotation.from_quat(motion.rest_rotations_wxyz, scalar_first=True).inv()
    matrices = np.tile(np.eye(4), (len(motion.parents), 1, 1))
    matrices[:, :3, :3] = turns.as_matrix()
    matrices[:, :3, 3] = -turns.apply(motion.rest_positions_m)
    return matrices.transpose(0, 2, 1).reshape(-1, 16).astype(np.float32)
