"""The operator's view, sent to every browser, so that others can follow it."""

from dataclasses import dataclass

import viser
from viser._messages import SetPositionMessage

_Point = tuple[float, float, float]

FROM_NODE, AT_NODE, PAGE_NODE = "/operator/from", "/operator/at", "/operator/page"
"""Invisible nodes. Their positions are the place of the operator's camera, the point in the middle of its picture
(stage frame [m]), and the page's number with its picture's width over height.
"""
_NODES = (FROM_NODE, AT_NODE, PAGE_NODE)


@dataclass(frozen=True)
class OperatorView:
    """The viewpoint of a page.

    Attributes:
        page: the page's number.
        position_m, target_m: the camera, and the point in the middle of its picture, stage frame [m].
        aspect: the picture's width over height.
    """

    page: int
    position_m: _Point
    target_m: _Point
    aspect: float


class OperatorNodes:
    """The nodes of one viser server; call it from the drawing thread."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._scene = server.scene
        self._shown: OperatorView | None = None

    def show(self, view: OperatorView | None) -> None:
        """Send a view to the browsers if it has changed, or report that there is none any longer."""
        if view == self._shown:
            return
        before, self._shown = self._shown, view
        if view is None:
            for node in _NODES:
                self._scene.remove_by_name(node)
            return
        if before is None:
            for node in _NODES:
                self._scene.add_frame(node, show_axes=False, visible=False)
        for node, position in (
            (FROM_NODE, view.position_m),
            (AT_NODE, view.target_m),
            (PAGE_NODE, (float(view.page), view.aspect, 0.0)),
        ):
            self._scene._queue_scene_message(SetPositionMessage(node, position))
