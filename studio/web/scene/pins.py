"""Pins of the replayed take: a ball at each place, and a glassy one as wide as its radius."""

import threading
from collections.abc import Sequence

import viser

NODE = "/pins"
BALL_M = 0.012
COLOUR = (232, 120, 20)
OFF = (150, 150, 150)
GLASS = 0.22

Pin = tuple[tuple[float, float, float], float, bool]
"""Place [m], stage frame; radius [m]; whether it is on."""


class PinMarks:
    """The pins that are shown; none at first. Methods may be called from any thread."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._lock = threading.Lock()
        self._scene = server.scene
        self._shown: tuple[Pin, ...] = ()
        self._handles: list[viser.SceneNodeHandle] = []

    @property
    def shown(self) -> tuple[Pin, ...]:
        """The pins that are shown."""
        with self._lock:
            return self._shown

    def show(self, pins: Sequence[Pin]) -> None:
        """Show these pins instead of the earlier ones."""
        with self._lock:
            if tuple(pins) == self._shown:
                return
            for handle in self._handles:
                handle.remove()
            self._handles = []
            for k, (place_m, radius_m, is_on) in enumerate(pins):
                colour = COLOUR if is_on else OFF
                name, sphere = f"{NODE}/{k}", self._scene.add_icosphere
                self._handles.append(sphere(name, radius=BALL_M, color=colour, position=place_m))
                if radius_m > BALL_M:
                    glass = sphere(
                        f"{NODE}/{k}-radius", radius=radius_m, color=colour, opacity=GLASS, position=place_m
                    )
                    self._handles.append(glass)
            self._shown = tuple(pins)
