"""Puts the page and the 3D view on the server's app."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from fastapi import FastAPI

from studio.engine.calibration.result import Calibration
from studio.engine.frames import StepResult
from studio.web.page import add_page
from studio.web.playback import Player, playback_routes
from studio.web.playback.routes import Takes
from studio.web.proxy import viewer_routes
from studio.web.routes import view_routes
from studio.web.view import View


class Stage(Protocol):
    """What the view needs of a live stage."""

    def subscribe(self, callback: Callable[[StepResult], None]) -> Callable[[], None]:
        """Call `callback` with every step, on the engine thread; the function returned ends that."""

    def calibration(self) -> Calibration | None:
        """Return the calibration in use."""

    def status(self) -> dict[str, Any]:
        """The stage's status as JSON; `cameras` is an object by name."""


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

    def look() -> tuple[Calibration | None, list[str]]:
        return stage.calibration(), sorted(stage.status().get("cameras", {}))

    view = View(look=look)
    player = Player(view)
    unsubscribe = stage.subscribe(view.show)
    app.include_router(viewer_routes(view.port))
    app.include_router(view_routes(view))
    app.include_router(playback_routes(player, takes))
    app.state.events["replay"] = player.status
    add_page(app, sessions=sessions)
    return ViewHandle(view, player, unsubscribe)
