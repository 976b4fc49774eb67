"""Small pictures of takes, made in the background by one process at a time, and stored in the takes' `exports/`."""

import logging
import threading
from pathlib import Path

from fastapi import APIRouter
from fastapi.responses import Response

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.takes.find import Finder
from studio.engine.base.errors import StudioError
from studio.live import LiveStage
from studio.take.library.sessions import TakeInfo
from studio.worker import run_in_process

FILE = "thumbnail.png"
BATCH = 40
"""Takes that one process draws before newer recordings are considered."""

_ORDER = ("finish", "studio", "live", "imported", "spliced")
_log = logging.getLogger(__name__)


class Thumbnails:
    """Makes missing pictures; `made` counts them."""

    def __init__(self, stage: LiveStage) -> None:
        self._stage = stage
        self._lock = threading.Lock()
        self._waiting: dict[Path, Path] = {}
        self._failed: set[Path] = set()
        self._thread: threading.Thread | None = None
        self.made = 0

    def want(self, takes: list[TakeInfo]) -> None:
        """Start to make the missing pictures of takes with solves; returns at once."""
        missing = {
            info.path: info.path / "solves" / best_solve(info.solves)
            for info in takes
            if info.solves and not picture_of(info.path).is_file()
        }
        with self._lock:
            self._waiting |= {path: solve for path, solve in missing.items() if path not in self._failed}
            if not self._waiting or self._thread is not None or self._stage.recording_name():
                return  # a recording has priority; the list is requested again when it ends
            self._thread = threading.Thread(target=self._run, name="thumbnails", daemon=True)
            self._thread.start()

    def _run(self) -> None:
        while True:
            with self._lock:
                batch = dict(list(self._waiting.items())[:BATCH])
                for path in batch:
                    del self._waiting[path]
                if not batch:
                    self._thread = None
                    return
            try:
                wanted = [(solve, picture_of(path)) for path, solve in batch.items()]
                done = run_in_process("studio.review.render.thumbnail:render_thumbnails", wanted, spare=False)
            except StudioError as error:
                _log.info("no thumbnails: %s", error)
                done = []
            self._failed |= {path for path in batch if picture_of(path) not in done}
            self.made += len(done)


def best_solve(names: tuple[str, ...]) -> str:
    """Return the best solve for a take's picture, by its name."""
    return next((name for name in _ORDER if name in names), names[0])


def picture_of(take: Path) -> Path:
    """Return the path of a take's picture, which need not exist."""
    return take / "exports" / FILE


def thumbnails_router(finder: Finder) -> APIRouter:
    """Return the route of the pictures."""
    router = APIRouter(prefix="/api/v1", tags=["takes"], responses=RESPONSES)

    @router.get("/takes/{session}/{take}/thumbnail", response_class=Response)
    def get_thumbnail(session: str, take: str) -> Response:
        """A small picture of a take (PNG); `thumbnail` in its line of the list says whether it exists."""
        try:
            picture = picture_of(finder.path(session, take)).read_bytes()
        except (FileNotFoundError, NotADirectoryError):  # also where the take is moved just now
            raise NotFoundError(
                "take.no_picture",
                "there is no picture of take {session}/{take} yet; a take with a solve gets one",
                session=session,
                take=take,
            ) from None
        return Response(picture, media_type="image/png", headers={"Cache-Control": "no-cache"})

    return router
