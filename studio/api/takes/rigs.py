"""Routes of users' rigs: stored in `sessions/rigs/`, each with its mapping next to it."""

from pathlib import Path

from fastapi import APIRouter, Request
from pydantic import Field
from starlette.concurrency import run_in_threadpool

from studio.api.errors import RESPONSES, NotFoundError
from studio.api.stage.stage import Request as Body
from studio.api.structs import StructRoute
from studio.engine.animation.retarget.facts import RigFacts
from studio.engine.base.errors import FormatError
from studio.take.folder.names import check_name, inside
from studio.worker import run_in_process

MAX_RIG_BYTES = 256 * 1024**2
RIG_KINDS = (".glb", ".fbx", ".bvh")
FOLDER = "rigs"


class MappingRequest(Body):
    """Roles of a rig's bones."""

    bones: dict[str, str | None] = Field(
        description="HumanIK role -> name of the bone; null or left out where there is none",
        examples=[{"Hips": "pelvis", "LeftUpLeg": "thigh_l"}],
    )


def rigs_router(sessions: Path) -> APIRouter:
    """Return the routes of the rigs in `sessions/rigs/`."""
    router = APIRouter(prefix="/api/v1/rigs", tags=["rigs"], responses=RESPONSES, route_class=StructRoute)

    @router.get("")
    def get_rigs() -> list[str]:
        """Names of the uploaded rigs."""
        folder = sessions / FOLDER
        return sorted(path.name for path in folder.glob("*") if path.suffix.lower() in RIG_KINDS)

    @router.put("/{name}", status_code=201)
    async def put_rig(name: str, request: Request) -> RigFacts:
        """Store a rig (GLB, FBX or BVH); the file is the request's body. Answers as for its mapping.

        A mapping saved for the same bones is used again.
        """
        path = _path(sessions, name)
        data = bytearray()
        async for piece in request.stream():
            data += piece
            if len(data) > MAX_RIG_BYTES:
                raise FormatError("rig.too_large", "a rig may have {mb} MB at most", mb=MAX_RIG_BYTES >> 20)
        return await run_in_threadpool(
            run_in_process, "studio.engine.animation.retarget.facts:keep_rig", bytes(data), path
        )

    @router.get("/{name}/mapping")
    def get_mapping(name: str) -> RigFacts:
        """The roles of the bones, those that keep their rest pose, sizes, and any problem."""
        return run_in_process("studio.engine.animation.retarget.facts:rig_facts", find_rig(sessions, name))

    @router.put("/{name}/mapping")
    def put_mapping(name: str, request: MappingRequest) -> RigFacts:
        """Correct the roles of the bones; stored for every export onto rigs with the same bones."""
        return run_in_process(
            "studio.engine.animation.retarget.facts:map_rig", find_rig(sessions, name), request.bones
        )

    return router


def find_rig(sessions: Path, name: str) -> Path:
    """Return the file of an uploaded rig.

    Raises:
        NotFoundError: there is none of that name.
        TakeError, FormatError: a name that is not allowed.
    """
    path = _path(sessions, name)
    if not path.is_file():
        raise NotFoundError(
            "rig.none",
            "there is no rig {name!r}; GET /api/v1/rigs lists them, PUT /api/v1/rigs/NAME sends one",
            name=name,
        )
    return path


def _path(sessions: Path, name: str) -> Path:
    check_name("rig", name)
    if Path(name).suffix.lower() not in RIG_KINDS:
        raise FormatError(
            "rig.name", "rig {name!r}: allowed are names that end in {kinds}", name=name, kinds=[*RIG_KINDS]
        )
    return inside(sessions / FOLDER, name)
