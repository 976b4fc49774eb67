"""Routes of reference motions: uploaded, or copied from next to the takes; checked, aligned, removed and restored."""

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Literal

from fastapi import APIRouter, Request
from msgspec import Struct, structs
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.stage.stage import Request as Body
from studio.api.structs import StructRoute
from studio.api.takes.find import Finder
from studio.api.takes.manage import receive
from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.sentences import say, system_says
from studio.engine.metrics.reference.reference import ReferenceFacts
from studio.take.folder.placing import PlacedReference, placed_facts
from studio.take.folder.references import (
    HowAligned,
    forget_placed,
    has_performer,
    how_aligned,
    keep_how_aligned,
    offered_file,
    offered_files,
    placed_path,
    reference_names,
    reference_path,
    remove_reference,
    restore_reference,
)
from studio.take.folder.take import Take
from studio.worker import run_in_process

MAX_REFERENCE_BYTES = 512 * 1024**2
MAX_NAME = 58
"""Longest name of a reference; its alignment options are stored next to it, under its name and `.json`."""


class TakeFileRequest(Body):
    """A file next to the takes."""

    file: str = Field(description="one of GET /api/v1/reference-files", examples=["monday/jump.truth.csv"])


class AlignRequest(Body):
    """Alignment options of a reference; stored with the reference."""

    solve: str = Field(description="the solve that it is aligned with", examples=["studio"])
    align_time: bool = Field(True, description="it has a clock of its own: offset and drift are estimated")
    align: Literal["rigid", "similarity"] = Field("rigid", description="similarity aligns the size too")
    unit_m: Annotated[float | None, Field(gt=0, description="metres per unit of a BVH")] = None
    performer: str | None = Field(
        None, description="of several performers whose motion it is; the first where left out"
    )


class KeptReference(ReferenceFacts, kw_only=True):
    """A reference that was stored: its name and size, and what it holds."""

    name: str
    bytes: int


class ReferenceOfTake(Struct):
    """A reference: its size, its alignment options, and by solve how it was aligned with it."""

    name: str
    bytes: int
    align_time: bool
    align: str
    unit_m: float | None
    performer: str | None
    aligned_with: dict[str, PlacedReference]


Removing = Callable[[str, str], None]
"""Receives a take, session/name, and its reference that is about to be removed."""


def references_router(sessions: Path, finder: Finder, removing: Removing) -> APIRouter:
    """Return the routes of the references of the takes in `sessions`; `removing` is called before one is removed."""
    router = APIRouter(prefix="/api/v1", tags=["references"], responses=RESPONSES, route_class=StructRoute)
    prefix = "/takes/{session}/{take}/references"

    @router.get("/reference-files")
    def get_files() -> list[str]:
        """Files next to the takes on the server that may be references."""
        return offered_files(sessions)

    @router.get(prefix)
    def get_references(session: str, take: str) -> list[str]:
        """Names of the take's references."""
        return reference_names(finder.take(session, take))

    @router.put(prefix + "/{name}", status_code=201)
    async def put_reference(session: str, take: str, name: str, request: Request) -> KeptReference:
        """Store a reference (BVH, CSV, C3D, TRC, FBX, GLB, poses.npz, targets); the file is the request's body.

        It is read first: an unreadable one is refused, and nothing is stored.
        """
        opened = await run_in_threadpool(finder.take, session, take)
        target = _new_path(opened, name)

        with _waiting_room(opened) as folder:
            file = Path(folder) / name
            too_large = say(
                "reference.too_large", "a reference may have {mb} MB at most", mb=MAX_REFERENCE_BYTES >> 20
            )
            await receive(request, file, MAX_REFERENCE_BYTES, too_large)
            return await run_in_threadpool(_keep, opened, file, target)

    @router.post(prefix, status_code=201)
    def take_file(session: str, take: str, request: TakeFileRequest) -> KeptReference:
        """Store a copy of a file from next to the takes."""
        opened = finder.take(session, take)
        source = offered_file(sessions, request.file)
        if source.stat().st_size > MAX_REFERENCE_BYTES:
            raise FormatError(
                "reference.too_large", "a reference may have {mb} MB at most", mb=MAX_REFERENCE_BYTES >> 20
            )
        target = _new_path(opened, source.name)
        with _waiting_room(opened) as folder:
            return _keep(opened, Path(shutil.copy(source, folder)), target)

    @router.get(prefix + "/{name}")
    def get_reference(session: str, take: str, name: str) -> ReferenceOfTake:
        """A reference, its alignment options, and its alignment with each solve."""
        opened = finder.take(session, take)
        path = find_reference(opened, name)
        found = {
            solve: placed_facts(placed_path(opened, name, solve))
            for solve in opened.solve_names()
            if has_performer(opened, name, solve)
        }
        placed = {solve: facts for solve, facts in found.items() if facts is not None}
        how = asdict(how_aligned(opened, name))
        return ReferenceOfTake(name, path.stat().st_size, **how, aligned_with=placed)

    @router.post(prefix + "/{name}/align")
    def align(session: str, take: str, name: str, request: AlignRequest) -> PlacedReference:
        """Align a reference with a solve; answers the alignment and the covered part."""
        opened = finder.take(session, take)
        path = find_reference(opened, name)
        poses = finder.solve(opened, request.solve, request.performer)
        how = HowAligned(request.align_time, request.align, request.unit_m, request.performer)
        if how != how_aligned(opened, name):
            forget_placed(opened, name)
        out = placed_path(opened, name, request.solve, how)
        found = run_in_process("studio.take.folder.placing:place_reference", opened, poses, path, how, out)
        keep_how_aligned(opened, name, how)
        return found

    @router.delete(prefix + "/{name}")
    def remove(session: str, take: str, name: str) -> dict[str, str]:
        """Remove a reference, also from the replay; it can be restored until another of its name is removed."""
        opened = finder.take(session, take)
        find_reference(opened, name)
        removing(f"{session}/{take}", name)
        remove_reference(opened, name)
        return {"removed": name}

    @router.post(prefix + "/{name}/restore")
    def restore(session: str, take: str, name: str) -> dict[str, str]:
        """Restore a removed reference."""
        restore_reference(finder.take(session, take), name)
        return {"restored": name}

    return router


def find_reference(take: Take, name: str) -> Path:
    """Return the path of a take's reference.

    Raises:
        NotFoundError: it has none of that name.
        TakeError, FormatError: a name that is not allowed.
    """
    path = reference_path(take, name)
    if not path.is_file():
        raise NotFoundError(
            "reference.send_first",
            "take {take} has no reference {name!r}; send it first",
            take=take.meta["id"],
            name=name,
        )
    return path


def _new_path(take: Take, name: str) -> Path:
    path = reference_path(take, name)
    if len(name) > MAX_NAME:
        raise FormatError(
            "reference.name_length",
            "reference {name!r} has {n} characters; allowed: {most} at most",
            name=name,
            n=len(name),
            most=MAX_NAME,
        )
    return path


def _waiting_room(take: Take) -> tempfile.TemporaryDirectory[str]:
    """Return a folder next to the take's references for a file that is not yet checked."""
    try:
        return tempfile.TemporaryDirectory(prefix=".reference-", dir=take.path)
    except OSError as error:
        raise StudioError(
            "file.unwritable", "cannot write {path}: {error}", path=take.path, error=system_says(error)
        ) from error


def _keep(take: Take, file: Path, target: Path) -> KeptReference:
    """Move a readable file to the take's references; answer its facts."""
    found: ReferenceFacts = run_in_process("studio.engine.metrics.reference.reference:reference_facts", file)
    size = file.stat().st_size
    target.parent.mkdir(exist_ok=True)
    forget_placed(take, target.name)
    file.replace(target)
    return KeptReference(**structs.asdict(found), name=target.name, bytes=size)
