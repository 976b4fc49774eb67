"""Bones of an FBX file: LimbNodes in the rest pose, every one in the BindPose."""

import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.curves.euler import ORDERS, euler_deg
from studio.engine.animation.export.fbx import scene
from studio.engine.animation.export.fbx.binary import Node
from studio.engine.animation.export.fbx.objects import Objects
from studio.engine.base.geometry import matrices
from studio.engine.base.quaternions import inverse, multiply

CM = 100.0
_TURN_TOLERANCE = 1e-9


def add_skeleton(
    objects: Objects,
    motion: LocalMotion,
    orders: list[str],
    *,
    space: str = "",
    under: np.int64 | None = None,
) -> list[np.int64]:
    """Add the joints in their rest pose and return their identities, in the order of the motion.

    Args:
        objects: of the file.
        motion: the skeleton.
        orders: of the joints' rotations.
        space: prefix of the joints' names, such as `Ana:`.
        under: the object above the skeleton; None = the scene.
    """
    before_deg = [euler_deg(turn[None], "ZYX")[0] for turn in motion.rest_local_wxyz]
    models: list[np.int64] = []
    for joint, (name, parent) in enumerate(zip(motion.joint_names, motion.parents, strict=True)):
        own = () if parent >= 0 or under is not None else undecided_rows(motion)
        model = _add_joint(
            objects, space + name, motion.offsets_m[joint] * CM, orders[joint], before_deg[joint], own
        )
        top = np.int64(0) if under is None else under
        objects.connect(model, top if parent < 0 else models[parent])
        models.append(model)
    poses = [
        Node("PoseNode", children=[Node("Node", model), Node("Matrix", matrix.ravel())])
        for model, matrix in zip(models, rest_matrices(motion), strict=True)
    ]
    head = [Node("Type", "BindPose"), Node("Version", 100), Node("NbPoseNodes", len(poses))]
    objects.add("Pose", "BindPose", "Pose", "BindPose", *head, *poses)
    return models


def add_performer(objects: Objects, name: str, motion: LocalMotion) -> np.int64:
    """Add the object above the skeleton of one of several performers, and return its identity."""
    attribute = objects.add("NodeAttribute", name, "NodeAttribute", "Null", Node("TypeFlags", "Null"))
    model = add_model(objects, name, "Null", undecided_rows(motion))
    objects.connect(attribute, model)
    objects.connect(model, np.int64(0))
    return model


def add_model(objects: Objects, name: str, kind: str, more: Sequence[Node] = ()) -> np.int64:
    """Add an object that stays at the origin, with further properties, and return its identity."""
    rows = scene.properties(
        scene.integer("InheritType", 1, "enum"),
        scene.integer("DefaultAttributeIndex", 0),
        scene.vector("Lcl Translation", np.zeros(3)),
        scene.vector("Lcl Rotation", np.zeros(3)),
        scene.vector("Lcl Scaling", np.ones(3)),
        *more,
    )
    culling = [Node("Shading", True), Node("Culling", "CullingOff")]
    return objects.add("Model", name, "Model", kind, Node("Version", 232), rows, *culling)


def undecided_rows(motion: LocalMotion) -> list[Node]:
    """Return the custom property `undecided_s`: spans [s] in which the performer's identity is uncertain, as JSON;
    none for a single performer."""
    if motion.undecided_s is None:
        return []
    return [scene.custom_text("undecided_s", json.dumps([list(span) for span in motion.undecided_s]))]


def local_turns(rest: LocalMotion, motion: LocalMotion) -> NDArray[np.float64]:
    """Return rotations on top of the rest pose's pre-rotations, shape (frame_count, joint_count, 4)."""
    before = rest.rest_local_wxyz
    if np.abs(before[:, 1:]).max() < _TURN_TOLERANCE:
        return motion.rotations_wxyz
    return multiply(inverse(before), motion.rotations_wxyz)


def rest_matrices(motion: LocalMotion) -> NDArray[np.float64]:
    """Return world matrices of the rest pose [cm] in FBX's convention (row vectors), shape (J, 4, 4)."""
    out = np.tile(np.eye(4), (len(motion.parents), 1, 1))
    out[:, :3, :3] = matrices(motion.rest_rotations_wxyz).transpose(0, 2, 1)
    out[:, 3, :3] = motion.rest_positions_m * CM
    return out


def _add_joint(
    objects: Objects,
    name: str,
    offset_cm: NDArray[np.float64],
    order: str,
    before_deg: NDArray[np.float64],
    more: Sequence[Node],
) -> np.int64:
    size = scene.properties(scene.number("Size", 1.0))
    attribute = objects.add(
        "NodeAttribute", name, "NodeAttribute", "LimbNode", size, Node("TypeFlags", "Skeleton")
    )
    rows = [
        scene.integer("RotationOrder", ORDERS.index(order), "enum"),
        scene.integer("RotationActive", 1, "bool"),
        scene.integer("InheritType", 1, "enum"),
        scene.integer("DefaultAttributeIndex", 0),
        scene.vector("Lcl Translation", offset_cm, animated=True),
        scene.vector("Lcl Rotation", np.zeros(3), animated=True),
        scene.vector("Lcl Scaling", np.ones(3)),
        *more,
    ]
    if np.abs(before_deg).max() > np.degrees(_TURN_TOLERANCE):
        rows.insert(1, scene.vector_of("PreRotation", before_deg))
    culling = [Node("Shading", True), Node("Culling", "CullingOff")]
    model = objects.add(
        "Model", name, "Model", "LimbNode", Node("Version", 232), scene.properties(*rows), *culling
    )
    objects.connect(attribute, model)
    return model
