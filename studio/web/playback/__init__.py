"""Replay in the browser view: a take's solve, and another as a ghost next to it.

`clip` loads a solve with its inputs; `player` keeps the time and gives the view steps like the
live stage, so that both look the same; `curves` computes the timeline; `routes` is the API.
"""

from studio.web.playback.player import Player
from studio.web.playback.routes import playback_routes

__all__ = ["Player", "playback_routes"]
