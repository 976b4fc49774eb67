"""Markers of another system in the browser view, as points."""

import numpy as np
import viser
from numpy.typing import NDArray

from studio.engine.model.rigid_body import PlacedMarkers
from studio.web.scene.clouds import ORIGIN_M, Cloud, CloudNode
from studio.web.scene.performers.skin import Rgb

NAMED_RGB, LOOSE_RGB = (128, 90, 213), (113, 128, 150)
_NONE_M = np.zeros((0, 3))


class MarkerNodes:
    """The markers of one scene, below its layer `bodies`: those with a name, and those without."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._nodes: dict[str, CloudNode] = {}

    def draw(self, markers: PlacedMarkers | None) -> None:
        """Show these markers, and no others."""
        named, loose = (_NONE_M, _NONE_M) if markers is None else (markers.named_m, markers.loose_m)
        self._draw("named", named, NAMED_RGB)
        self._draw("loose", loose, LOOSE_RGB)

    def _draw(self, which: str, points_m: NDArray[np.float64], rgb: Rgb) -> None:
        node = self._nodes.get(which)
        if not len(points_m):
            if node is not None:
                self._nodes.pop(which).remove()
            return
        cloud = Cloud((points_m - ORIGIN_M).astype(np.float16), None)
        if node is None:
            self._nodes[which] = CloudNode(self._server, f"/bodies/markers/{which}", rgb, cloud)
        else:
            node.draw(cloud)
