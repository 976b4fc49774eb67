"""Replay in the browser view: a take's solve, and another as a ghost beside it.

`clip` loads a solve with what it was made of; `player` keeps the place in time and gives the view a step as the live
stage would, so that both look the same; `curves` is what the timeline draws; `routes` the API of it all.
"""

from studio.web.playback.player import Player
from studio.web.playback.routes import playback_routes

__all__ = ["Player", "playback_routes"]
