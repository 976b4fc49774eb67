"""Routes of the replay under `/api/v1/replay`. What is replayed is the same in all browsers, as on one screen."""

from typing import Annotated, Any, Protocol

from fastapi import APIRouter, Query
from pydantic import BaseModel, ConfigDict, Field

from studio.engine.errors import SettingsError
from studio.take.take import Take
from studio.web.playback.clip import Clip
from studio.web.playback.curves import MAX_POINTS, curves
from studio.web.playback.player import Player


class Takes(Protocol):
    """Finds takes and their solves."""

    def take(self, session: str, name: str) -> Take:
        """Return a take."""

    def solve(self, take: Take, name: str) -> Any:
        """Return where a take's solve lies."""


class _Body(BaseModel):
    model_config = ConfigDict(extra="forbid")


class SolveOfTake(_Body):
    """A solve of a take."""

    take: str = Field(description="the take's id, session/name", examples=["monday/take_001"])
    solve: str = Field(examples=["studio"])


class OpenRequest(SolveOfTake):
    """What is replayed, and what is shown beside it."""

    ghost: SolveOfTake | None = Field(None, description="a second solve, of this or another take")


class ChangeRequest(_Body):
    """What is changed; the rest stays. Frames count from 0."""

    playing: bool | None = None
    frame: int | None = Field(None, description="go there")
    step: int | None = Field(None, description="pause, and go on by so many frames; negative: back")
    speed: float | None = Field(None, description="0.05 to 4; 1 is real time")
    loop: bool | None = None
    first: int | None = Field(None, description="first frame of the range that is played")
    last: int | None = Field(None, description="last frame of the range")


def playback_routes(player: Player, takes: Takes) -> APIRouter:
    """Return the routes of one player."""
    router = APIRouter(prefix="/api/v1/replay", tags=["replay"])

    def load(wanted: SolveOfTake) -> Clip:
        session, _, name = wanted.take.partition("/")
        take = takes.take(session, name)
        takes.solve(take, wanted.solve)
        return Clip.load(take, wanted.solve)

    @router.get("")
    def get_replay() -> dict[str, Any]:
        """Where the replay is; `open` is false while the live stage is shown."""
        return player.status()

    @router.put("")
    def open_replay(request: OpenRequest) -> dict[str, Any]:
        """Show a take's solve instead of the live stage; cameras go on being received and recorded."""
        clip = load(request)
        player.open(clip, None if request.ghost is None else load(request.ghost))
        return player.status()

    @router.patch("")
    def change_replay(request: ChangeRequest) -> dict[str, Any]:
        """Play, pause, scrub, set speed, loop and range."""
        player.change(**request.model_dump())
        return player.status()

    @router.delete("")
    def close_replay() -> dict[str, Any]:
        """Show the live stage again."""
        player.close_clip()
        return player.status()

    @router.get("/curves")
    def get_curves(
        joint: Annotated[str, Query(description="an output joint", examples=["LeftHand"])] = "Hips",
        points: Annotated[int, Query(ge=2, le=20_000)] = MAX_POINTS,
    ) -> dict[str, Any]:
        """Curves of one joint of the solve that is replayed, for the timeline."""
        clip = player.clip
        if clip is None:
            raise SettingsError("nothing is replayed; open a take first")
        return curves(clip, joint, points)

    return router
