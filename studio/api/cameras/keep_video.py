"""Whether phones keep video: the operator decides for all of them, and phones request it from time to time."""

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
    """Return the routes; the choice holds until the server ends."""
    router = APIRouter(tags=["cameras"], responses=RESPONSES)
    asked = KeepVideo(keep=False)

    @router.get(VIDEO_PATH, dependencies=[Depends(camera_check(access))])
    def hear_keep_video() -> KeepVideo:
        """Whether phones keep video, for phones; they need a camera's token where cameras need one."""
        return asked

    @router.get(f"{PHONE_API}/video")
    def get_keep_video() -> KeepVideo:
        """Whether all phones keep video."""
        return asked

    @router.put(f"{PHONE_API}/video")
    def put_keep_video(body: KeepVideo) -> KeepVideo:
        """Let all phones keep video, or let each phone decide."""
        asked.keep = body.keep
        return asked

    return router
