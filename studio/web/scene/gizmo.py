"""The gizmo: three arrows in the 3D view by which a joint is dragged to its place."""

import threading

import viser

NODE = "/gizmo"
SCALE = 0.32
"""Length of an arrow [m]."""


class Gizmo:
    """Arrows that every browser may drag; hidden at first. Methods may be called from any thread."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._lock = threading.Lock()
        self._stage_ns: int | None = None
        self._shown = False
        self._drags = 0
        self._handle = server.scene.add_transform_controls(
            NODE, scale=SCALE, line_width=3.5, disable_rotations=True, depth_test=False, visible=False
        )
        self._handle.on_update(self._dragged)

    def show(self, place_m: tuple[float, float, float]) -> None:
        """Show it at a place [m], in the shown frame."""
        with self._lock:
            self._shown, self._drags = True, 0
            self._handle.position = place_m
            self._handle.visible = True

    def hide(self) -> None:
        """Hide it."""
        with self._lock:
            if self._shown:
                self._shown = self._handle.visible = False

    def at(self, stage_ns: int | None) -> None:
        """Hide it if another stage time [ns] is shown than before; None = the live stage."""
        if stage_ns != self._stage_ns:
            self._stage_ns = stage_ns
            self.hide()

    def state(self) -> tuple[tuple[float, float, float], int] | None:
        """Return its place [m], and the number of drags since it is shown; None while it is hidden."""
        with self._lock:
            if not self._shown:
                return None
            x, y, z = (float(value) for value in self._handle.position)
            return (x, y, z), self._drags

    def _dragged(self, event: viser.TransformControlsEvent) -> None:
        if event.phase == "end":
            with self._lock:
                self._drags += 1
