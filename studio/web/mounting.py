"""Adds the page and the 3D view to the server's app."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from fastapi import FastAPI

from studio.api.add_routes import add_routes
from studio.api.jobs import Jobs
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import StepResult
from studio.engine.robots.files import FOLDER as ROBOTS
from studio.live.cameras.previews import Previews
from studio.live.states import StageStatus
from studio.web.page import add_page
from studio.web.playback import Player, playback_routes
from studio.web.playback.finder import TakeFinder
from studio.web.playback.robots import ChosenRobots
from studio.web.playback.videos import Videos, video_routes
from studio.web.points.live import LiveDepth
from studio.web.proxy import viewer_routes
from studio.web.routes import view_routes, view_state
from studio.web.scene.drawing import Surroundings
from studio.web.scene.frusta import Picture
from studio.web.view import LiveView


class ViewedStage(Protocol):
    """The view's interface to a live stage; `clock_ns` is the server's clock."""

    clock_ns: Callable[[], int]
    previews: Previews

    def subscribe(self, callback: Callable[[StepResult], object], *, raw: bool = False) -> Callable[[], None]:
        """Call `callback` with every step on the engine thread; with `raw`, also with steps without a body. The
        returned function ends the subscription."""
        ...

    def calibration(self) -> Calibration | None:
        """Return the calibration in use."""
        ...

    def status(self) -> StageStatus:
        """The stage's status."""
        ...


class ViewHandle:
    """The mounted view; call `close` when the server closes."""

    def __init__(
        self, view: LiveView, player: Player, videos: Videos, unsubscribe: Callable[[], None]
    ) -> None:
        self.view = view
        self._videos = videos
        self._player = player
        self._unsubscribe = unsubscribe

    def close(self) -> None:
        """Stop drawing and close viser."""
        self._unsubscribe()
        self._player.close()
        self._videos.stills.close()
        self.view.close()


def mount(app: FastAPI, stage: ViewedStage, *, sessions: Path, takes: TakeFinder, jobs: Jobs) -> ViewHandle:
    """Serve the page at `/` and the 3D view at `/viewer/`, and draw the stage's results.

    Args:
        app: the server's app; routes are added to it.
        stage: the live stage.
        sessions: folder of the recorded takes; takes: finds them; jobs: the server's work in the background.
    """

    def look() -> Surroundings:
        status = stage.status()
        return Surroundings(
            stage.calibration(),
            sorted(status.cameras),
            {
                name: picture
                for name in status.cameras
                if (picture := _picture(stage.previews, name)) is not None
            },
            status.pipeline.clock_offset_ns,
            {one.number: one.name for one in status.performers if one.number is not None},
        )

    def clock() -> float:
        return stage.clock_ns() * 1e-9

    view = LiveView(look=look, depth=LiveDepth(stage.previews.depth, stage.calibration, clock), clock=clock)
    player, videos = Player(view), Videos()
    robots = ChosenRobots(view, player, takes, jobs, sessions / ROBOTS)
    unsubscribe = stage.subscribe(view.show, raw=True)
    add_routes(app, viewer_routes(view.port))
    add_routes(app, view_routes(view, robots))
    add_routes(app, playback_routes(player, takes, robots))
    add_routes(app, video_routes(player, takes, videos))
    app.state.player = player
    app.state.events["replay"] = player.status
    app.state.events["edits"] = lambda: app.state.edits_stamp.of(player.clip.take if player.clip else "")
    app.state.events["view"] = lambda: view_state(view, robots)
    add_page(app, sessions=sessions)
    return ViewHandle(view, player, videos, unsubscribe)


def _picture(previews: Previews, name: str) -> Picture | None:
    """Return a camera's picture, None if its client sends none."""
    number = previews.count(name)
    newest = previews.newest(name) if number else None
    if newest is None:
        return None
    grey, camera = newest
    return Picture(grey, 2.0 * math.atan(camera.height / (2.0 * camera.fy)), number)
