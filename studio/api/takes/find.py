"""Finds takes for the routes, and makes a take's line of the list."""

from pathlib import Path

from fastapi import Request
from fastapi.responses import JSONResponse
from msgspec import Struct

from studio.api.errors import NotFoundError, studio_error
from studio.engine.base.errors import FormatError, SettingsError, StudioError, TakeError
from studio.engine.base.value_sentences import bad_setting
from studio.live import LiveStage
from studio.take.folder.take import POSES, Take
from studio.take.library.sessions import TakeInfo, take_path


class ListedTake(Struct):
    """A take's line of the list: the fields of `TakeInfo`; its id, session/name, its length [s], the size of its
    videos [bytes], whether there is a thumbnail; the performers if there are several."""

    id: str
    session: str
    name: str
    created: str
    seconds: float | None
    calibration_s: float | None
    cameras: tuple[str, ...]
    solves: tuple[str, ...]
    depth: tuple[str, ...]
    calibrated: bool
    state: str
    recording: bool
    source: str
    performer: str
    notes: str
    tags: tuple[str, ...]
    rating: int | None
    starred: bool
    problem: str | None
    video_bytes: int
    thumbnail: bool
    performers: tuple[str, ...]
    performer_names: dict[str, str]


class Finder:
    """The takes in one folder of sessions, except the one that is being recorded."""

    def __init__(self, stage: LiveStage, sessions: Path) -> None:
        self._stage = stage
        self.sessions = sessions

    def path(self, session: str, name: str) -> Path:
        """Return a take's folder.

        Raises:
            NotFoundError: there is no such take.
            TakeError: a name that is not allowed.
        """
        path = take_path(self.sessions, session, name)
        if not (path / "take.json").is_file():
            raise NotFoundError(
                "take.none", "there is no take {take}; GET /api/v1/takes lists them", take=f"{session}/{name}"
            )
        return path

    def take(self, session: str, name: str) -> Take:
        """Return a take.

        Raises:
            NotFoundError: there is no such take.
            TakeError: it is being recorded, or cannot be read.
        """
        path = self.path(session, name)
        if self._stage.recording_name() == f"{session}/{name}":
            raise TakeError(
                "take.recording", "take {take} is being recorded; stop it first", take=f"{session}/{name}"
            )
        return Take.open(path)

    def by_id(self, take_id: str) -> Take:
        """Return a take by its id, session/name.

        Raises:
            SettingsError: no id.
            NotFoundError, TakeError: as `take`.
        """
        session, slash, name = take_id.partition("/")
        if not slash:
            raise SettingsError(bad_setting("take", take_id, "session/name"))
        return self.take(session, name)

    def solve(self, take: Take, name: str, performer: str | None = None) -> Path:
        """Return the `poses.npz` of a take's solve; of several performers that of `performer`, by default the first.

        Raises:
            NotFoundError: the take has no such solve.
            TakeError: the solve has no such performer.
        """
        if name not in take.solve_names():
            raise NotFoundError(
                "take.no_solve",
                "take {take} has no solve {name!r}; it has: {others}",
                take=take.meta["id"],
                name=name,
                others=[*take.solve_names()],
            )
        return take.performer_folder(name, performer) / POSES

    async def gone(self, request: Request, error: Exception) -> JSONResponse:
        """Answer a request whose files are missing or, where it reads, damaged; if its take has gone to the trash
        meanwhile, the answer is that there is no such take."""
        asked = request.path_params
        brought = isinstance(error, FormatError) and request.method != "GET"  # came with the request
        if "session" in asked and "take" in asked and not brought:
            try:
                self.path(asked["session"], asked["take"])
            except StudioError as none:
                return await studio_error(request, none)
        if isinstance(error, StudioError):
            return await studio_error(request, error)
        raise error

    @staticmethod
    def line(info: TakeInfo) -> ListedTake:
        """Return a take's line of the list."""
        return ListedTake(
            id=f"{info.session}/{info.name}",
            session=info.session,
            name=info.name,
            created=info.created,
            seconds=None if info.length_s is None else round(info.length_s, 3),
            calibration_s=info.calibration_s,
            cameras=info.cameras,
            solves=info.solves,
            depth=info.depth,
            calibrated=info.calibrated,
            state=info.state,
            recording=info.state == "recording",
            source=info.source,
            performer=info.performer,
            notes=info.notes,
            tags=info.tags,
            rating=info.rating,
            starred=info.starred,
            problem=info.problem,
            video_bytes=info.video_bytes,
            performers=info.performers,
            performer_names=info.performer_names,
            thumbnail=(info.path / "exports" / "thumbnail.png").is_file(),
        )
