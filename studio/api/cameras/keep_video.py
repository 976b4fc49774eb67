"""Whether phones keep video: asked for by the operator for all of them, and heard by phones from time to time."""

from fastapi import APIRouter, Depends
from pydantic import BaseModel, ConfigDict, Field

from studio.api.access.tokens import Access
from studio.api.cameras.phones import PHONE_API
from studio.api.cameras.video_parts import camera_check
from studio.api.errors import RESPONSES
from studio.wire import VIDEO_PATH


class KeepVideo(BaseModel):
    """Whether phones keep video."""

    model_config = ConfigDict(extra="forbid")

    keep: bool = Field(
        description="all phones record video during takes; false: those whose own switch is on"
    )


def keep_video_router(access: Access) -> APIRouter:
    """Return the routes; what is asked for holds until the server ends."""
    router = APIRouter(tags=["cameras"], responses=RESPONSES)
    asked = KeepVideo(keep=False)

    @router.get(VIDEO_PATH, dependencies=[Depends(camera_check(access))])
    def hear_keep_video() -> KeepVideo:
        """What phones hear; they ask with a camera's token where cameras need one."""
        return asked

    @router.get(f"{PHONE_API}/video")
    def get_keep_video() -> KeepVideo:
        """Whether all phones keep video."""
        return asked

    @router.put(f"{PHONE_API}/video")
    def put_keep_video(body: KeepVideo) -> KeepVideo:
        """Let all phones keep video, or leave it to each."""
        asked.keep = body.keep
        return asked

    return router
