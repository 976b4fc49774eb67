"""The live 3D view: a viser server on the loopback, and a thread that draws the newest result at 30 Hz."""

import io
import logging
import socket
import threading
import time
from collections.abc import Callable
from contextlib import redirect_stdout

import numpy as np
import viser

from studio.engine.calibration.result import Calibration
from studio.engine.frames import StepResult
from studio.web.scene import LAYERS, Scene

_log = logging.getLogger(__name__)

DRAW_HZ = 30.0
Look = Callable[[], tuple[Calibration | None, list[str]]]

LOST_AFTER_S = 0.6
"""A performer whom no camera has seen for this long is hidden."""


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _sees_performer(result: StepResult) -> bool:
    """Whether a camera saw any of the performer in this step (and not only the memory of the filters)."""
    return bool(np.isfinite(result.frame_set.positions).all(axis=2).any())


class View:
    """Draws what the engine makes, latest wins: `show` never waits for the browser.

    `look` returns the calibration in use, if there is one, and the cameras' names in the order of their
    colours; it is called from the drawing thread. `clock` is a monotonic clock [s].
    """

    def __init__(self, *, look: Look, clock: Callable[[], float] = time.monotonic) -> None:
        self._look = look
        self._clock = clock
        with redirect_stdout(io.StringIO()):  # viser prints a banner with its loopback address
            self._server = viser.ViserServer(
                host="127.0.0.1", port=_free_port(), label="Stage", verbose=False
            )
        self._server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._changed = threading.Condition()
        self._result: StepResult | None = None
        self._layers = {name: shown for name, (_, shown) in LAYERS.items()}
        self._stopping = False
        self._scene = Scene(self._server)
        self._thread = threading.Thread(target=self._run, name="view", daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """Loopback port of the viser server."""
        return self._server.get_port()

    @property
    def layers(self) -> dict[str, bool]:
        """Layer -> whether it is shown."""
        with self._changed:
            return dict(self._layers)

    @property
    def colours(self) -> dict[str, tuple[int, int, int]]:
        """Camera -> RGB colour."""
        return dict(self._scene.colours)

    def show(self, result: StepResult) -> None:
        """Have a step drawn as soon as the last one is; a newer one replaces it. Safe from any thread."""
        with self._changed:
            self._result = result
            self._changed.notify()

    def set_layers(self, layers: dict[str, bool]) -> None:
        """Show or hide layers (keys of `LAYERS`)."""
        with self._changed:
            self._layers.update(layers)
            self._changed.notify()

    def close(self) -> None:
        """Stop drawing and close the viser server."""
        with self._changed:
            self._stopping = True
            self._changed.notify()
        self._thread.join(timeout=5.0)
        with redirect_stdout(io.StringIO()):  # and a line when it stops
            self._server.stop()

    def _run(self) -> None:
        last_seen_s, last_draw_s, shown = -np.inf, -np.inf, False
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._stopping or self._result is not None, timeout=0.2)
                if self._stopping:
                    return
                result, self._result = self._result, None
                layers = dict(self._layers)
            now_s = self._clock()
            if result is not None and _sees_performer(result):
                last_seen_s = now_s
            visible = now_s - last_seen_s < LOST_AFTER_S
            try:
                calibration, cameras = self._look()
                with self._server.atomic():
                    self._scene.use_cameras(cameras)
                    self._scene.use_calibration(calibration)
                    for layer, on in layers.items():
                        self._scene.show_layer(layer, on)
                    if visible and result is not None:
                        self._scene.draw(result)
                    elif shown and not visible:
                        self._scene.hide_performer()
            except Exception:  # the view must not end because one frame could not be drawn
                _log.exception("the 3D view could not draw a frame")
            shown = visible
            pause_s = last_draw_s + 1.0 / DRAW_HZ - self._clock()
            if pause_s > 0:
                time.sleep(pause_s)
            last_draw_s = self._clock()
