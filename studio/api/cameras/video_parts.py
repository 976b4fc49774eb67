"""Routes by which camera clients bring the videos that they recorded during takes."""

from collections.abc import Callable
from itertools import pairwise
from typing import Annotated

from fastapi import APIRouter, Depends, Header, HTTPException, Query, Request
from msgspec import Struct
from pydantic import BaseModel, ConfigDict, Field
from starlette.concurrency import run_in_threadpool

from studio.api.access.tokens import Access
from studio.api.errors import RESPONSES
from studio.api.structs import StructRoute
from studio.engine.base.errors import FormatError
from studio.engine.base.sentences import say
from studio.live.keeping.video import MAX_PART_BYTES, MAX_PART_FRAMES, LateVideos, PartState, VideoPart
from studio.wire import VIDEO_PATH

_Id = Annotated[str, Field(min_length=1, max_length=100)]
_Time = Annotated[int, Field(ge=0, le=2**62)]
_BEARER = "Bearer "


class VideoPartRequest(BaseModel):
    """A part of a camera's video; see the camera protocol."""

    model_config = ConfigDict(extra="forbid")

    take_id: _Id
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}$")]
    boot_id: _Id
    from_sequence: Annotated[int, Field(ge=0, le=2**62)] = 0
    size: Annotated[int, Field(ge=1, le=MAX_PART_BYTES, description="[bytes]")]
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    ending: Annotated[str, Field(pattern=r"^\.(mp4|webm|ivf)$")]
    times_ns: Annotated[list[_Time], Field(min_length=1, max_length=MAX_PART_FRAMES)]


class VideoPartAnswer(Struct):
    """What the server has of a part, and its `state`: `wanted`, `kept`, `unwanted`, `unknown` or `later`."""

    id: str
    state: str
    received: int
    reason: str


def camera_check(access: Access) -> Callable[[str], None]:
    """Return a check that refuses a request without a camera's token, where cameras need one."""

    def check(authorization: Annotated[str, Header()] = "") -> None:
        token = authorization.removeprefix(_BEARER) if authorization.startswith(_BEARER) else ""
        if access.is_let_go(token) or (access.required and access.camera_token_id(token) is None):
            raise HTTPException(401, say("video.no_token", "a video comes with a camera's valid token only"))

    return check


def video_parts_router(access: Access, videos: LateVideos) -> APIRouter:
    """Return the routes; they require a camera's token where cameras need one."""
    router = APIRouter(
        tags=["cameras"],
        responses=RESPONSES,
        route_class=StructRoute,
        dependencies=[Depends(camera_check(access))],
    )

    @router.post(VIDEO_PATH)
    def begin_part(body: VideoPartRequest) -> VideoPartAnswer:
        """Describe a part of a video; answers whether it is wanted, and from which byte on."""
        times = tuple(body.times_ns)
        if any(after <= before for before, after in pairwise(times)):
            raise FormatError(
                "video.times", "{name}: the times of its frames must increase, one per frame", name=body.name
            )
        part = VideoPart(
            body.take_id, body.name, body.boot_id, body.from_sequence, body.size, body.sha256, body.ending, times
        )  # fmt: skip
        return _answer(videos.begin(part))

    @router.put(VIDEO_PATH + "/{id}")
    async def send_piece(id: str, request: Request, at: Annotated[int, Query(ge=0)]) -> VideoPartAnswer:
        """Send a piece of a part, from byte `at` on: the body, 4 MB at most. The last one completes it."""
        data = await request.body()
        return _answer(await run_in_threadpool(videos.write, id, at, data))

    return router


def _answer(state: PartState) -> VideoPartAnswer:
    return VideoPartAnswer(state.id, state.state, state.received, state.reason)
