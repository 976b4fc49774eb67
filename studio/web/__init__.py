"""The browser's side: the page at `/`, the 3D view (viser) at `/viewer/`, and the view's routes.

`view` draws the engine's results, `scene` holds the drawn objects, `playback` replays takes, `proxy` passes viser
through the studio's port, `routes` is the view's API, `page` serves the page with its modules. Nothing here changes
the stage.
"""

from studio.web.mounting import ViewHandle, mount

__all__ = ["ViewHandle", "mount"]
