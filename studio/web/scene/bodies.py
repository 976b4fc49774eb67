"""Rigid bodies of another system in the browser view: their shapes, or three axes if the shape is unknown."""

from collections.abc import Sequence
from typing import Any

import viser

from studio.engine.model.rigid_body import PlacedBody, RigidShape

_RGB = {"prop": (214, 158, 46), "evidence": (49, 151, 149), "reference": (128, 90, 213)}
_OTHER_RGB = (113, 128, 150)
_AXES_M = 0.12
_ALONG = {
    "x": (0.7071068, 0.0, 0.7071068, 0.0),
    "y": (0.7071068, -0.7071068, 0.0, 0.0),
    "z": (1.0, 0.0, 0.0, 0.0),
}


class BodyNodes:
    """The bodies of one scene, below its layer `bodies`."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._scene = server.scene
        self._nodes: dict[str, tuple[object, viser.FrameHandle]] = {}
        self._count = 0

    def draw(self, bodies: Sequence[PlacedBody]) -> None:
        """Show these bodies where they are, and no others."""
        for one in bodies:
            node = self._node(one)
            node.position, node.wxyz = tuple(one.position_m.tolist()), tuple(one.rotation_wxyz.tolist())
            node.visible = True
        names = {one.name for one in bodies}
        for name, (_, node) in self._nodes.items():
            if name not in names:
                node.visible = False

    def _node(self, body: PlacedBody) -> viser.FrameHandle:
        looks = (body.use, body.shape)
        known = self._nodes.get(body.name)
        if known is not None and known[0] == looks:
            return known[1]
        if known is not None:
            known[1].remove()
        self._count += 1
        path = f"/bodies/{self._count}"  # a name may contain any character
        node = self._scene.add_frame(
            path, show_axes=body.shape is None, axes_length=_AXES_M, axes_radius=_AXES_M / 20
        )
        rgb = _RGB.get(body.use, _OTHER_RGB)
        if body.shape is not None:
            self._add_shape(f"{path}/shape", body.shape, rgb)
        self._scene.add_label(f"{path}/name", body.name)
        self._nodes[body.name] = (looks, node)
        return node

    def _add_shape(self, path: str, shape: RigidShape, rgb: tuple[int, int, int]) -> None:
        size = [edge / 100 for edge in shape.size_cm]
        common: dict[str, Any] = {"color": rgb, "cast_shadow": True}
        if shape.kind == "box":
            x, y, z = size
            self._scene.add_box(path, dimensions=(x, y, z), **common)
        elif shape.kind == "sphere":
            self._scene.add_icosphere(path, radius=size[0] / 2, **common)
        else:
            self._scene.add_cylinder(
                path, radius=size[0] / 2, height=size[1], wxyz=_ALONG[shape.axis], **common
            )
