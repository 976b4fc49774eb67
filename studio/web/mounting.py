"""Puts the page and the 3D view on the server's app."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from fastapi import FastAPI

from studio.api.add_routes import add_routes
from studio.engine.calibration.result import Calibration
from studio.engine.frames import StepResult
from studio.live.previews import Previews
from studio.web.drawing import Surroundings
from studio.web.frusta import Picture
from studio.web.page import add_page
from studio.web.playback import Player, playback_routes
from studio.web.playback.routes import Takes
from studio.web.proxy import viewer_routes
from studio.web.routes import view_routes, view_state
from studio.web.view import View


class Stage(Protocol):
    """What the view needs of a live stage; `clock_ns` is the server's clock."""

    clock_ns: Callable[[], int]
    previews: Previews

    def subscribe(self, callback: Callable[[StepResult], None]) -> Callable[[], None]:
        """Call `callback` with every step, on the engine thread; the function returned ends that."""

    def calibration(self) -> Calibration | None:
        """Return the calibration in use."""

    def status(self) -> dict[str, Any]:
        """The stage's status as JSON; `cameras` is an object by name, `pipeline` has `clock_offset_ns`."""


class ViewHandle:
    """The mounted view; `close` it with the server."""

    def __init__(self, view: View, player: Player, unsubscribe: Callable[[], None]) -> None:
        self.view = view
        self._player = player
        self._unsubscribe = unsubscribe

    def close(self) -> None:
        """Stop drawing and close viser."""
        self._unsubscribe()
        self._player.close()
        self.view.close()


def mount(app: FastAPI, stage: Stage, *, sessions: Path, takes: Takes) -> ViewHandle:
    """Serve the page at `/` and the 3D view at `/viewer/`, and draw what the stage makes.

    Args:
        app: the server's app; routes are added to it.
        stage: the live stage.
        sessions: folder of the recorded takes; takes: finds them.
    """

    def look() -> Surroundings:
        status = stage.status()
        cameras = status.get("cameras", {})
        return Surroundings(
            stage.calibration(),
            sorted(cameras),
            {name: picture for name in cameras if (picture := _picture(stage.previews, name)) is not None},
            status.get("pipeline", {}).get("clock_offset_ns"),
        )

    view = View(look=look, clock=lambda: stage.clock_ns() * 1e-9)
    player = Player(view)
    unsubscribe = stage.subscribe(view.show)
    add_routes(app, viewer_routes(view.port))
    add_routes(app, view_routes(view))
    add_routes(app, playback_routes(player, takes))
    app.state.player = player
    app.state.events["replay"] = player.status
    app.state.events["view"] = lambda: view_state(view).model_dump()
    add_page(app, sessions=sessions)
    return ViewHandle(view, player, unsubscribe)


def _picture(previews: Previews, name: str) -> Picture | None:
    """Return what a camera sees, None where its client does not tell."""
    number = previews.count(name)
    newest = previews.newest(name) if number else None
    if newest is None:
        return None
    grey, camera = newest
    return Picture(grey, 2.0 * math.atan(camera.height / (2.0 * camera.fy)), number)
