"""The body of an FBX file: a mesh in the rest pose, skinned with one cluster per bone."""

import numpy as np

from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.export.fbx import scene
from studio.engine.animation.export.fbx.binary import Node
from studio.engine.animation.export.fbx.objects import Objects
from studio.engine.animation.export.fbx.skeleton import CM, add_model, rest_matrices
from studio.engine.animation.mannequin import mannequin

_NAME = "Mannequin"
_TONES = {"Body": (0.72, 0.72, 0.70), "Seam": (0.22, 0.22, 0.24)}
"""Material name -> colour, in the order of the mesh's tones."""


def add_mesh(
    objects: Objects,
    motion: LocalMotion,
    models: list[np.int64],
    *,
    space: str = "",
    under: np.int64 | None = None,
) -> None:
    """Add the mannequin of the motion's skeleton, skinned to its bones.

    Args:
        objects: of the file.
        motion: the skeleton.
        models: identities of the bones.
        space, under: as in `add_skeleton`.

    Raises:
        FormatError: as `mannequin`.
    """
    mesh = mannequin(motion)
    corners = mesh.triangles.astype(np.int32)
    corners[:, 2] = -corners[:, 2] - 1  # FBX marks the last corner of a polygon this way
    geometry = objects.add(
        "Geometry", space + _NAME, "Geometry", "Mesh",
        scene.properties(),
        Node("GeometryVersion", 124),
        Node("Vertices", (mesh.vertices_m.astype(float) * CM).ravel()),
        Node("PolygonVertexIndex", corners.ravel()),
        _layer("LayerElementNormal", "ByVertice", "Direct", Node("Normals", mesh.normals.astype(float).ravel())),
        _layer("LayerElementMaterial", "ByPolygon", "IndexToDirect", Node("Materials", mesh.tones.astype(np.int32))),
        Node("Layer", 0, children=[Node("Version", 100), *(
            Node("LayerElement", children=[Node("Type", kind), Node("TypedIndex", 0)])
            for kind in ("LayerElementNormal", "LayerElementMaterial")
        )]),
    )  # fmt: skip
    model = add_model(objects, space + _NAME, "Mesh")
    objects.connect(model, np.int64(0) if under is None else under)
    objects.connect(geometry, model)
    for name, colour in _TONES.items():
        objects.connect(_add_material(objects, space + name, colour), model)
    skin = objects.add(
        "Deformer", "", "Deformer", "Skin", Node("Version", 101), Node("Link_DeformAcuracy", 50.0)
    )
    objects.connect(skin, geometry)
    for joint, link in enumerate(rest_matrices(motion)):
        vertices, slots = np.nonzero((mesh.joint_indices == joint) & (mesh.weights > 0.0))
        children = [Node("Version", 100), Node("UserData", "", "")]
        if len(vertices):
            weights = mesh.weights[vertices, slots].astype(float)
            children += [Node("Indexes", vertices.astype(np.int32)), Node("Weights", weights)]
        children += [
            Node("Transform", np.linalg.inv(link).ravel()),
            Node("TransformLink", link.ravel()),
        ]
        cluster = objects.add(
            "Deformer", space + motion.joint_names[joint], "SubDeformer", "Cluster", *children
        )
        objects.connect(cluster, skin)
        objects.connect(models[joint], cluster)


def _layer(kind: str, mapping: str, reference: str, *values: Node) -> Node:
    head = [Node("Version", 101), Node("Name", "")]
    head += [Node("MappingInformationType", mapping), Node("ReferenceInformationType", reference)]
    return Node(kind, 0, children=[*head, *values])


def _add_material(objects: Objects, name: str, colour: tuple[float, float, float]) -> np.int64:
    rows = scene.properties(scene.colour("DiffuseColor", colour), scene.number("DiffuseFactor", 1.0))
    shading = [Node("Version", 102), Node("ShadingModel", "lambert"), Node("MultiLayer", 0)]
    return objects.add("Material", name, "Material", "", *shading, rows)
