"""Routes of users' rigs: kept in `sessions/rigs/`, each with the table of which bone is what beside it."""

from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.stage import Request as Body
from studio.api.work import keep_rig_work, map_rig_work, rig_work
from studio.engine.errors import FormatError
from studio.take.names import check_name, inside
from studio.worker import run_in_process

MAX_RIG_BYTES = 256 * 1024**2
RIG_KINDS = (".glb", ".fbx", ".bvh")
FOLDER = "rigs"


class MappingRequest(Body):
    """Which bone of a rig is what."""

    bones: dict[str, str | None] = Field(
        description="HumanIK role -> name of the bone; null or left out where there is none",
        examples=[{"Hips": "pelvis", "LeftUpLeg": "thigh_l"}],
    )


def rigs_router(sessions: Path) -> APIRouter:
    """Return the routes of the rigs in `sessions/rigs/`."""
    router = APIRouter(prefix="/api/v1/rigs", tags=["rigs"], responses=RESPONSES)

    @router.get("")
    def get_rigs() -> list[str]:
        """Names of the rigs that were sent."""
        folder = sessions / FOLDER
        return sorted(path.name for path in folder.glob("*") if path.suffix.lower() in RIG_KINDS)

    @router.put("/{name}", status_code=201)
    async def put_rig(name: str, request: Request) -> dict[str, Any]:
        """Keep a rig (GLB, FBX or BVH); the file is the request's body. Answers as its mapping does.

        A mapping that was saved for the same bones is used again.
        """
        path = _path(sessions, name)
        data = bytearray()
        async for piece in request.stream():
            data += piece
            if len(data) > MAX_RIG_BYTES:
                raise FormatError(f"a rig may have {MAX_RIG_BYTES >> 20} MB at most")
        return await run_in_threadpool(run_in_process, keep_rig_work, bytes(data), path)

    @router.get("/{name}/mapping")
    def get_mapping(name: str) -> dict[str, Any]:
        """Which bone is what (`bones`), which keep their rest pose (`unmapped`), sizes, and any `problem`."""
        return run_in_process(rig_work, find_rig(sessions, name))

    @router.put("/{name}/mapping")
    def put_mapping(name: str, request: MappingRequest) -> dict[str, Any]:
        """Correct which bone is what; kept for every export onto rigs of the same bones."""
        return run_in_process(map_rig_work, find_rig(sessions, name), request.bones)

    return router


def find_rig(sessions: Path, name: str) -> Path:
    """Return the file of a rig that was sent.

    Raises:
        NotFoundError: there is none of that name. TakeError, FormatError: a name that is not allowed.
    """
    path = _path(sessions, name)
    if not path.is_file():
        raise NotFoundError(
            f"there is no rig {name!r}; GET /api/v1/rigs lists them, PUT /api/v1/rigs/NAME sends one"
        )
    return path


def _path(sessions: Path, name: str) -> Path:
    check_name("rig", name)
    if Path(name).suffix.lower() not in RIG_KINDS:
        raise FormatError(f"rig {name!r}: allowed are names that end in {', '.join(RIG_KINDS)}")
    return inside(sessions / FOLDER, name)
