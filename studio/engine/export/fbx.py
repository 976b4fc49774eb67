"""FBX: binary 7400, a skeleton of LimbNodes with one animation curve per channel.

Centimetres, y up, facing +z, a T-pose of zero rotations in the BindPose. Every channel has its own curve of
unrolled Euler angles in the joint's rotation order; the order is the usual one unless a joint comes near its
gimbal lock, where a curve would no longer follow the motion between its keys.
"""

import os

import numpy as np
from numpy.typing import NDArray

from studio.engine.export import fbx_scene as scene
from studio.engine.export.euler import ORDERS, best_order, euler_deg
from studio.engine.export.fbx_binary import EncodedArray, Node, write_nodes
from studio.engine.export.options import ExportOptions
from studio.engine.export.skeleton import LocalMotion
from studio.engine.files import write_atomically

_CUBIC = 0x2108  # cubic, automatic tangents, time-independent: a slope is that of the two neighbours' chord
_CUBIC_USER = 0x408  # cubic, with the slopes that the keys bring
_KEY_FLAGS = {"cubic": _CUBIC, "linear": 0x4, "constant": 0x2}

_WEIGHTS = np.array([0x0D050D05], np.int32).view(np.float32)[0]  # two thirds of 0.3333, in units of 1e-4
_CURVE_VERSION = 4008
_FIRST_IDENTITY = 1_000_000


def write_fbx(motion: LocalMotion, path: str | os.PathLike[str], options: ExportOptions) -> None:
    """Write the motion as a binary FBX file, atomically.

    Args:
        motion: of any skeleton with one root.
        path: of the file; an existing one is replaced.
        options: `interpolation` counts here.

    Raises:
        StudioError: the file cannot be written.
    """
    take_name = motion.name
    orders = [best_order(motion.rotations_wxyz[:, joint]) for joint in range(len(motion.parents))]
    builder = _Builder(motion, _KEY_FLAGS[options.interpolation])
    models = builder.add_skeleton(orders)
    builder.add_animation(models, orders, take_name)
    nodes = [
        *scene.header(),
        scene.global_settings(motion.frames_per_second, builder.stop),
        *scene.documents(builder.identity(), take_name),
        scene.definitions(builder.objects),
        Node("Objects", children=builder.objects),
        Node("Connections", children=builder.connections),
        scene.takes(take_name, builder.stop),
    ]
    with write_atomically(path) as file:
        write_nodes(file, nodes)


class _Builder:
    """Collects the objects of one file and how they are connected."""

    def __init__(self, motion: LocalMotion, key_flags: int) -> None:
        self.objects: list[Node] = []
        self.connections: list[Node] = []
        self._motion = motion
        times = scene.ticks(np.arange(motion.frame_count), motion.frames_per_second)
        self.stop: np.int64 = times[-1]
        self._last_identity = _FIRST_IDENTITY
        self._key_times = EncodedArray(times)
        self._key_flags = key_flags

    def identity(self) -> np.int64:
        self._last_identity += 1
        return np.int64(self._last_identity)

    def add_skeleton(self, orders: list[str]) -> list[np.int64]:
        """Add the joints in their rest pose and return their identities, in the order of the motion."""
        motion = self._motion
        models: list[np.int64] = []
        for joint, (name, parent) in enumerate(zip(motion.joint_names, motion.parents, strict=True)):
            model = self.identity()
            self._add_joint(model, name, motion.offsets_m[joint] * 100.0, orders[joint])
            self._connect(model, np.int64(0) if parent < 0 else models[parent])
            models.append(model)
        self._add_bind_pose(models, motion.rest_positions_m * 100.0)
        return models

    def add_animation(self, models: list[np.int64], orders: list[str], take_name: str) -> None:
        """Add a stack with one layer, and curves for rotations and for positions that have keys."""
        stack, layer = self.identity(), self.identity()
        span = [
            scene.time(f"{which}{end}", value)
            for which in ("Local", "Reference")
            for end, value in (("Start", np.int64(0)), ("Stop", self.stop))
        ]
        self._add("AnimationStack", stack, take_name, "AnimStack", "", scene.properties(*span))
        self._add("AnimationLayer", layer, "BaseLayer", "AnimLayer", "")
        self._connect(layer, stack)
        for joint, model in enumerate(models):
            if joint in self._motion.positions_m:
                tracks = self._motion.positions_m[joint] * 100.0
                self._add_curves(layer, model, "Translation", tracks)
            angles = euler_deg(self._motion.rotations_wxyz[:, joint], orders[joint])
            self._add_curves(layer, model, "Rotation", angles)

    def _add(self, kind: str, identity: np.int64, name: str, tag: str, subtype: str, *children: Node) -> None:
        self.objects.append(
            Node(kind, identity, f"{name}\x00\x01{tag}", subtype, children=children, closed=True)
        )

    def _connect(self, child: np.int64, parent: np.int64, to_property: str | None = None) -> None:
        values = ("OO", child, parent) if to_property is None else ("OP", child, parent, to_property)
        self.connections.append(Node("C", *values))

    def _add_joint(self, model: np.int64, name: str, offset_cm: NDArray[np.float64], order: str) -> None:
        attribute = self.identity()
        size = scene.properties(scene.number("Size", 1.0))
        self._add(
            "NodeAttribute", attribute, name, "NodeAttribute", "LimbNode", size, Node("TypeFlags", "Skeleton")
        )
        rows = scene.properties(
            scene.integer("RotationOrder", ORDERS.index(order), "enum"),
            scene.integer("RotationActive", 1, "bool"),
            scene.integer("InheritType", 1, "enum"),
            scene.integer("DefaultAttributeIndex", 0),
            scene.vector("Lcl Translation", offset_cm, animated=True),
            scene.vector("Lcl Rotation", np.zeros(3), animated=True),
            scene.vector("Lcl Scaling", np.ones(3)),
        )
        culling = [Node("Shading", True), Node("Culling", "CullingOff")]
        self._add("Model", model, name, "Model", "LimbNode", Node("Version", 232), rows, *culling)
        self._connect(attribute, model)

    def _add_bind_pose(self, models: list[np.int64], rest_cm: NDArray[np.float64]) -> None:
        poses = []
        for model, position in zip(models, rest_cm, strict=True):
            matrix = np.eye(4)
            matrix[3, :3] = position  # FBX matrices multiply rows
            poses.append(Node("PoseNode", children=[Node("Node", model), Node("Matrix", matrix.ravel())]))
        head = [Node("Type", "BindPose"), Node("Version", 100), Node("NbPoseNodes", len(poses))]
        self._add("Pose", self.identity(), "BindPose", "Pose", "BindPose", *head, *poses)

    def _add_curves(
        self, layer: np.int64, model: np.int64, channel: str, tracks: NDArray[np.float64]
    ) -> None:
        """Add curves of x, y, z, shape (frame_count, 3): `Translation` [cm] or `Rotation` [deg]."""
        node = self.identity()
        starts = [scene.number(f"d|{axis}", tracks[0, i], animated=True) for i, axis in enumerate("XYZ")]
        self._add("AnimationCurveNode", node, channel[0], "AnimCurveNode", "", scene.properties(*starts))
        self._connect(node, layer)
        self._connect(node, model, f"Lcl {channel}")
        for i, axis in enumerate("XYZ"):
            curve = self.identity()
            keys = [
                Node("Default", float(tracks[0, i])),
                Node("KeyVer", _CURVE_VERSION),
                Node("KeyTime", self._key_times),
                Node("KeyValueFloat", tracks[:, i].astype(np.float32)),
                *_key_attributes(tracks[:, i], self._motion.frames_per_second, self._key_flags),
            ]
            self._add("AnimationCurve", curve, "", "AnimCurve", "", *keys)
            self._connect(curve, node, f"d|{axis}")


def _key_attributes(track: NDArray[np.float64], frames_per_second: float, flags: int) -> list[Node]:
    """Return the flags and slopes of a curve's keys, run by run.

    An automatic tangent at either end is the chord to its only neighbour, which errs most where a motion
    starts fast; cubic curves bring the slope of the parabola through the three keys there instead.
    """
    count = len(track)
    runs = [(count, flags, 0.0, 0.0)]
    if flags == _CUBIC and count >= 3:
        first = (-3 * track[0] + 4 * track[1] - track[2]) * frames_per_second / 2
        last = (3 * track[-1] - 4 * track[-2] + track[-3]) * frames_per_second / 2
        runs = [(1, _CUBIC_USER, first, 0.0), (count - 3, flags, 0.0, 0.0),
                (1, flags, 0.0, last), (1, _CUBIC_USER, last, 0.0)]  # fmt: skip
        runs = [run for run in runs if run[0]]
    # per run: right slope, left slope of the next key, weights, velocity
    slopes = np.array([[right, next_left, _WEIGHTS, 0.0] for _, _, right, next_left in runs], np.float32)
    return [
        Node("KeyAttrFlags", np.array([run[1] for run in runs], np.int32)),
        Node("KeyAttrDataFloat", slopes.ravel()),
        Node("KeyAttrRefCount", np.array([run[0] for run in runs], np.int32)),
    ]
