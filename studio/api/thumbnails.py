"""Small pictures of takes: made in the background, one process at a time, and kept in the takes' `exports/`."""

import logging
import threading
from pathlib import Path

from fastapi import APIRouter
from fastapi.responses import FileResponse

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.find import Finder
from studio.api.work import thumbnails_work
from studio.engine.errors import StudioError
from studio.live import LiveStage
from studio.take.sessions import TakeInfo
from studio.worker import run_in_process

FILE = "thumbnail.png"
BATCH = 40
"""Takes that one process draws, before what was recorded meanwhile has its turn."""

_ORDER = ("finish", "studio", "live", "imported")
_log = logging.getLogger(__name__)


class Thumbnails:
    """Makes the pictures that are missing; `made` counts them."""

    def __init__(self, stage: LiveStage) -> None:
        self._stage = stage
        self._lock = threading.Lock()
        self._waiting: dict[Path, Path] = {}
        self._failed: set[Path] = set()
        self._thread: threading.Thread | None = None
        self.made = 0

    def want(self, takes: list[TakeInfo]) -> None:
        """Have the missing pictures of takes with solves made; returns at once."""
        missing = {
            info.path: info.path / "solves" / best_solve(info.solves) / "poses.npz"
            for info in takes
            if info.solves and not picture_of(info.path).is_file()
        }
        with self._lock:
            self._waiting |= {path: poses for path, poses in missing.items() if path not in self._failed}
            if not self._waiting or self._thread is not None or self._stage.recording_name():
                return  # a recording comes first; the list is asked for again when it ends
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
                wanted = [(poses, picture_of(path)) for path, poses in batch.items()]
                done = run_in_process(thumbnails_work, wanted, spare=False)
            except StudioError as error:
                _log.info("no thumbnails: %s", error)
                done = []
            self._failed |= {path for path in batch if picture_of(path) not in done}
            self.made += len(done)


def best_solve(names: tuple[str, ...]) -> str:
    """Return the solve that shows a take best, by its name."""
    return next((name for name in _ORDER if name in names), names[0])


def picture_of(take: Path) -> Path:
    """Return where a take's picture lies, made or not."""
    return take / "exports" / FILE


def thumbnails_router(finder: Finder) -> APIRouter:
    """Return the route of the pictures."""
    router = APIRouter(prefix="/api/v1", tags=["takes"], responses=RESPONSES)

    @router.get("/takes/{session}/{take}/thumbnail", response_class=FileResponse)
    def get_thumbnail(session: str, take: str) -> FileResponse:
        """A small picture of a take (PNG); `thumbnail` in its line of the list says whether it is made yet."""
        file = picture_of(finder.path(session, take))
        if not file.is_file():
            raise NotFoundError(
                f"there is no picture of take {session}/{take} yet; a take with a solve gets one"
            )
        return FileResponse(file, media_type="image/png", headers={"Cache-Control": "no-cache"})

    return router
