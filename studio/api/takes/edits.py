"""Routes of a take's edits: list, change, undo and redo."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
from fastapi import APIRouter, Depends, Query, Request
from msgspec import Struct
from pydantic import Field

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.jobs import Jobs, JobStatus
from studio.api.stage.stage import Request as Body
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder
from studio.api.takes.takes import Replayer, settings_of
from studio.engine.edits.edit import Edit
from studio.engine.metrics.results import CleanupEventJson
from studio.take.edits.carry import carried
from studio.take.edits.change import change_edits, no_such_edit, redo_edits, undo_edits
from studio.take.edits.kept import EDITS_FILE, TakeEdits, edit_from_json, read_edits
from studio.take.folder.take import Take
from studio.worker import run_in_process

if TYPE_CHECKING:
    from studio.offline.edits.offers import Offer

_Revision = Annotated[
    int | None, Field(description="that of the list on which it is made; the newest where left out")
]


class EditRequest(Body):
    """An edit, as `edits.json` has it (docs/edits.md), or some of its keys; the `id` of a new one may be left out."""

    edit: dict[str, Any] = Field(
        examples=[{"kind": "pin", "joint": "left_wrist", "start_s": 4.2, "end_s": 4.2, "place_m": [0.3, -0.2, 1.1]}]
    )  # fmt: skip
    revision: _Revision = None


class EditsRequest(Body):
    """All edits of a take."""

    edits: list[dict[str, Any]]
    revision: _Revision = None


class HistoryRequest(Body):
    """An undo or a redo."""

    revision: _Revision = None


class EditsOfTake(Struct):
    """The edits of a take.

    Attributes:
        revision: rises by one with every change, undo and redo.
        calibration: number of the calibration under which places and directions hold.
        says: a note that they were carried to another calibration; "" = they were not.
    """

    revision: int
    calibration: int | None
    edits: tuple[Edit, ...]
    can_undo: bool
    can_redo: bool
    says: str


class OfferedEdits(Struct):
    """A clean-up event, its cause, and alternative edits that would mend it.

    Attributes:
        camera: the one whose joint is furthest from the body's course; null = none.
        joint: the canonical joint; off_mm: how far it is off.
        why: the cause, one line.
        edits: the likeliest first.
    """

    event: CleanupEventJson
    camera: str | None
    joint: str
    off_mm: float
    why: str
    edits: tuple[Edit, ...]


class OffersOfSolve(Struct):
    """The clean-up events of a solve in order of time, each with what would mend it."""

    offers: list[OfferedEdits]


class EditsStamp:
    """Detects changes of the edits of a take, whoever made them."""

    def __init__(self, sessions: Path) -> None:
        self._sessions = sessions

    def of(self, take: str) -> str:
        """Return a text that changes with the edits of a take, session/name; "" = it has none."""
        session, _, name = take.partition("/")
        try:
            state = (self._sessions / session / name / EDITS_FILE).stat()
        except OSError:
            return ""
        return f"{state.st_mtime_ns}-{state.st_ino}"


_LOOKED_AT = "the solve that is replayed; it has settings"

_Look = Callable[[], JobStatus | None]
"""Begins the preview that was requested with a change."""


class PreviewRequest(Body):
    """The solve that is replayed."""

    solve: str = Field(description=_LOOKED_AT, examples=["studio"])


def edits_router(finder: Finder, jobs: Jobs) -> APIRouter:
    """Return the routes of edits."""
    router = APIRouter(
        prefix="/api/v1/takes/{session}/{take}/edits",
        tags=["edits"],
        responses=RESPONSES,
        route_class=StructRoute,
    )

    def looking(http: Request, session: str, take: str, solve: str) -> Callable[[], JobStatus]:
        """Return a function that begins a preview around the present playhead; its errors are raised now."""
        opened, id_ = finder.take(session, take), f"{session}/{take}"
        finder.solve(opened, solve)
        settings = settings_of(opened, solve)
        player: Replayer = http.app.state.player
        at_s, performer = player.playhead(id_)

        def look() -> JobStatus:
            jobs.replace(("draft", "solve"), id_, solve)
            job = jobs.submit(
                "draft", id_, solve, "studio.offline.edits.first_look:look_at_edits", opened, settings, solve, at_s,
                performer=performer, then=lambda poses: player.show_part(id_, poses, performer),
            )  # fmt: skip
            return jobs.get(job.id)

        return look

    def look_after(
        http: Request,
        session: str,
        take: str,
        look: Annotated[
            str | None,
            Query(description=f"{_LOOKED_AT}: begin its preview after the change, as POST preview does"),
        ] = None,
    ) -> _Look:
        """Return a function that begins the requested preview; it does nothing if none is requested."""
        return (lambda: None) if look is None else looking(http, session, take, look)

    after = Depends(look_after)

    @router.get("")
    def get_edits(session: str, take: str) -> EditsOfTake:
        """The edits of a take, in the order in which they were made."""
        opened = finder.take(session, take)
        kept, says = carried(opened, read_edits(opened))
        return _answer(kept, says)

    @router.put("")
    def replace(session: str, take: str, request: EditsRequest, look: _Look = after) -> EditsOfTake:
        """Replace all edits of a take, as one change."""
        opened = finder.take(session, take)
        edits = [edit_from_json(one) for one in request.edits]
        new = {one.id for one in edits}
        gone = [one.id for one in read_edits(opened).edits if one.id not in new]
        return _changed(change_edits(opened, edits, gone, revision=request.revision), look)

    @router.post("", status_code=201)
    def add(session: str, take: str, request: EditRequest, look: _Look = after) -> EditsOfTake:
        """Add an edit; it is the last one of the answer. An edit with the same `id` is replaced."""
        opened = finder.take(session, take)
        edit = edit_from_json({"id": "", **request.edit})
        return _changed(change_edits(opened, [edit], revision=request.revision), look)

    @router.post("/undo")
    def undo(
        session: str, take: str, request: HistoryRequest | None = None, look: _Look = after
    ) -> EditsOfTake:
        """Undo the last change, whoever made it; refused if the list's revision is not `revision`."""
        opened = finder.take(session, take)
        return _changed(undo_edits(opened, revision=request.revision if request else None), look)

    @router.post("/redo")
    def redo(
        session: str, take: str, request: HistoryRequest | None = None, look: _Look = after
    ) -> EditsOfTake:
        """Redo the change that was last undone; refused if the list's revision is not `revision`."""
        opened = finder.take(session, take)
        return _changed(redo_edits(opened, revision=request.revision if request else None), look)

    @router.post("/preview", status_code=202)
    def preview(session: str, take: str, request: PreviewRequest, http: Request) -> JobStatus:
        """Solve the time around the playhead with the take's edits, and show it there until the solve is made again;
        nothing is stored. Answers the job."""
        return looking(http, session, take, request.solve)()

    @router.put("/preview", status_code=204)
    def read_ahead(session: str, take: str, request: PreviewRequest, http: Request) -> None:
        """Read what a preview of the replayed performer needs, when dragging of a joint begins; the next preview is
        then faster."""
        opened = finder.take(session, take)
        finder.solve(opened, request.solve)
        player: Replayer = http.app.state.player
        _, performer = player.playhead(f"{session}/{take}")
        run_in_process(
            "studio.offline.edits.first_look:read_ahead",
            opened, settings_of(opened, request.solve), performer=performer,
        )  # fmt: skip

    @router.get("/offers")
    def get_offers(session: str, take: str, solve: str, performer: str = "") -> OffersOfSolve:
        """What to mend in a solve, in order of time: each clean-up event, its cause, and edits that would mend it."""
        opened = finder.take(session, take)
        finder.solve(opened, solve, performer or None)
        found: list[Offer] = run_in_process(
            "studio.offline.edits.offered:offers_of_solve", opened, solve, performer
        )
        lines = [
            OfferedEdits(one.event, one.camera, one.joint, one.off_mm, one.why, one.edits) for one in found
        ]
        return OffersOfSolve(lines)

    @router.patch("/{edit}")
    def change(session: str, take: str, edit: str, request: EditRequest, look: _Look = after) -> EditsOfTake:
        """Change some keys of an edit; refused where it was changed since `revision`."""
        opened = finder.take(session, take)
        before = msgspec.to_builtins(_known(opened, edit))
        changed = edit_from_json({**before, **request.edit, "id": edit})
        return _changed(change_edits(opened, [changed], revision=request.revision), look)

    @router.delete("/{edit}")
    def remove(
        session: str,
        take: str,
        edit: str,
        revision: Annotated[int | None, Query()] = None,
        look: _Look = after,
    ) -> EditsOfTake:
        """Remove an edit; refused where it was changed since `revision`."""
        opened = finder.take(session, take)
        _known(opened, edit)
        return _changed(change_edits(opened, remove=[edit], revision=revision), look)

    return router


def _known(take: Take, edit: str) -> Edit:
    """Return an edit by its id.

    Raises:
        NotFoundError: there is none.
    """
    kept, _ = carried(take, read_edits(take))
    found = kept.by_id().get(edit)
    if found is None:
        raise NotFoundError(no_such_edit(edit, kept.edits).sentence)
    return found


def _changed(kept: TakeEdits, look: _Look) -> EditsOfTake:
    """Return the edits after a change; begin the requested preview."""
    look()
    return _answer(kept)


def _answer(kept: TakeEdits, says: str = "") -> EditsOfTake:
    return EditsOfTake(kept.revision, kept.calibration, kept.edits, bool(kept.undo), bool(kept.redo), says)
