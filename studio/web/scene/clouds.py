"""Point clouds of depth cameras in the browser view.

viser's handle compares and copies every array. A cloud's message, put directly into viser's queue, is sent
unchanged. The queue keeps only the newest of each camera, so that a browser that connects later gets that one.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray
from viser._messages import SceneNodeUpdateMessage

from studio.web.scene.performers.skin import Rgb

ORIGIN_M = np.array([0.0, 0.0, 1.0])
"""Origin of sent points: 16-bit numbers are finest around 0, so that the performer gets the finest ones."""

POINT_SIZE_M = 0.014


@dataclass(frozen=True, eq=False)
class Cloud:
    """The points that one camera sees.

    Attributes:
        points: relative to `ORIGIN_M` in the stage frame [m], float16, shape (N, 3).
        colours: RGB of each point, uint8, shape (N, 3); None: the camera's colour.
    """

    points: NDArray[np.float16]
    colours: NDArray[np.uint8] | None


class CloudNode:
    """One camera's cloud in the scene; it is not empty."""

    def __init__(self, server: viser.ViserServer, name: str, rgb: Rgb, cloud: Cloud) -> None:
        self.rgb, self.coloured = rgb, cloud.colours is not None
        self._scene = server.scene
        self._handle = server.scene.add_point_cloud(
            name, cloud.points, rgb if cloud.colours is None else cloud.colours, point_size=POINT_SIZE_M,
            point_shape="circle", precision="float16", position=ORIGIN_M,
        )  # fmt: skip
        self._name = self._handle.name

    def draw(self, cloud: Cloud) -> None:
        """Show another cloud, with or without colours as the first."""
        updates = {"points": cloud.points} | ({} if cloud.colours is None else {"colors": cloud.colours})
        self._scene._queue_scene_message(SceneNodeUpdateMessage(self._name, updates))

    def remove(self) -> None:
        """Remove it from the scene."""
        self._handle.remove()


class CloudNodes:
    """The clouds of all cameras, under `/points`."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._nodes: dict[str, CloudNode] = {}
        self._drawn: dict[str, Cloud] = {}

    def draw(self, clouds: Mapping[str, Cloud], colours: Mapping[str, Rgb]) -> None:
        """Show these clouds by camera and no others; `colours` has those of the cameras."""
        shown = {name: cloud for name, cloud in clouds.items() if len(cloud.points)}
        for name, node in list(self._nodes.items()):
            alike = name in shown and node.coloured == (shown[name].colours is not None)
            if not alike or node.rgb != colours[name]:
                self._nodes.pop(name).remove()
                del self._drawn[name]
        for name, cloud in shown.items():
            if name not in self._nodes:
                self._nodes[name] = CloudNode(self._server, f"/points/{name}", colours[name], cloud)
            elif self._drawn[name] is not cloud:
                self._nodes[name].draw(cloud)
            self._drawn[name] = cloud
