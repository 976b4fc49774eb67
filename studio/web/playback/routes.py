"""Routes of the replay under `/api/v1/replay`. All browsers show the same replay."""

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Query
from pydantic import BaseModel, ConfigDict, Field

from studio.api.stage.shown import ReplayStatus
from studio.api.structs import StructRoute
from studio.engine.base.errors import SettingsError
from studio.engine.metrics.reference.placing import PlacedMotion
from studio.engine.model.joints import OUTPUT_JOINTS
from studio.take.folder.performers import performer_by_name, performer_number
from studio.take.folder.references import how_aligned, placed_path, reference_path
from studio.take.folder.take import Take
from studio.web.playback.clip import Clip
from studio.web.playback.curves import MAX_POINTS, Curves, curves
from studio.web.playback.finder import TakeFinder
from studio.web.playback.joint_curves import CHANNELS, MAX_CURVES, CurveColumns, JointCurves
from studio.web.playback.player import Player
from studio.web.playback.raw_clip import load_raw
from studio.web.playback.robots import ChosenRobots
from studio.web.playback.second import Second, alignment_of
from studio.worker import run_in_process


class _ReplayBody(BaseModel):
    model_config = ConfigDict(extra="forbid")


class ReplayedSolve(_ReplayBody):
    """A solve of a take."""

    take: str = Field(description="the take's id, session/name", examples=["monday/take_001"])
    solve: str = Field(
        examples=["studio"],
        description="empty: what the cameras saw, without a solve; one that is being made is shown as far as it is",
    )


class ReplayedPerformerOf(ReplayedSolve):
    """A solve of a take, and the one of several performers for the curves and the edit list."""

    performer: str | None = Field(
        None, description="`performer_1`, ... or a name; the first where left out", examples=["performer_2"]
    )


class GhostRequest(_ReplayBody):
    """A second figure: a solve of this or another take, or a reference that was aligned with this one."""

    take: str | None = Field(None, description="the take's id; the one that is replayed where left out")
    solve: str | None = Field(None, min_length=1)
    reference: str | None = Field(None, examples=["truth.csv"])
    alignment: dict[str, Any] | None = Field(
        None, description="how the replayed solve lies to this one, as a comparison answers it"
    )


class OpenRequest(ReplayedPerformerOf):
    """The solve to replay, and the second figure."""

    ghost: GhostRequest | None = None


class Space(BaseModel):
    """Outermost points of a motion from its first to its last frame, stage frame [m]."""

    points_m: list[tuple[float, float, float]]


class Joints(BaseModel):
    """Positions of the output skeleton's joints by name, stage frame [m]; unknown ones are left out."""

    positions_m: dict[str, tuple[float, float, float]]


class ChangeRequest(_ReplayBody):
    """Changes; missing fields stay. Frames count from 0."""

    playing: bool | None = None
    frame: int | None = Field(None, description="go there")
    step: int | None = Field(None, description="pause, and move by this many frames; negative: back")
    speed: float | None = Field(None, description="0.05 to 4; 1 is real time")
    loop: bool | None = None
    first: int | None = Field(None, description="first frame of the range that is played")
    last: int | None = Field(None, description="last frame of the range")
    ghost_offset_ms: float | None = Field(None, description="the second figure is so far ahead in its motion")
    ghost_apart_m: float | None = Field(None, description="the second figure stands so far to the side")


def playback_routes(player: Player, takes: TakeFinder, robots: ChosenRobots) -> APIRouter:
    """Return the routes of one player."""
    router = APIRouter(prefix="/api/v1/replay", tags=["replay"], route_class=StructRoute)

    columns = CurveColumns()

    def load(wanted: ReplayedPerformerOf) -> Clip:
        session, _, name = wanted.take.partition("/")
        take = takes.take(session, name)
        if not wanted.solve:
            return load_raw(take)
        growing = player.growing.find(wanted.take, wanted.solve)
        if growing is not None:
            return growing
        takes.solve(take, wanted.solve)
        return Clip.load(take, wanted.solve, _performer(take, wanted))

    def second(wanted: GhostRequest, clip: Clip) -> Second:
        id_ = wanted.take or clip.take
        if (wanted.solve is None) == (wanted.reference is None):
            raise SettingsError("replay.one_ghost", "a ghost is a solve or a reference: give one of the two")
        if wanted.solve is not None:
            how = None if wanted.alignment is None else alignment_of(wanted.alignment)
            beside = load(ReplayedPerformerOf(take=id_, solve=wanted.solve, performer=None))
            return Second.solve(beside.chosen(clip.performer), clip, how)
        if id_ != clip.take or wanted.reference is None:
            raise SettingsError(
                "replay.ghost_elsewhere",
                "a reference of take {take} lies on another stage; allowed: one of {own}",
                take=id_,
                own=clip.take,
            )
        session, _, name = clip.take.partition("/")
        take = takes.take(session, name)
        kept, how = placed_path(take, wanted.reference, clip.solve), how_aligned(take, wanted.reference)
        if not kept.is_file():
            file = reference_path(take, wanted.reference)
            solve = takes.solve(take, clip.solve, how.performer)
            run_in_process("studio.take.folder.placing:place_reference", take, solve, file, how, kept)
        number = performer_number(performer_by_name(take.meta, how.performer)) if how.performer else 1
        return Second.reference(clip.take, wanted.reference, PlacedMotion.load(kept).motion, number)

    def _performer(take: Take, wanted: ReplayedPerformerOf) -> str | None:
        """Return the wanted performer; None if another solve of the take has them and this one does not."""
        if wanted.performer is None:
            return None
        performer = performer_by_name(take.meta, wanted.performer)
        elsewhere = performer in take.all_performers()
        return None if elsewhere and performer not in take.performer_names(wanted.solve) else performer

    @router.get("")
    def get_replay() -> ReplayStatus:
        """State of the replay; `open` is false while the live stage is shown."""
        return player.status()

    @router.put("")
    def open_replay(request: OpenRequest) -> ReplayStatus:
        """Show a take's solve instead of the live stage; cameras are still received and recorded."""
        clip = load(request)
        player.open(clip, None if request.ghost is None else second(request.ghost, clip))
        robots.follow_replay()
        return player.status()

    @router.patch("")
    def change_replay(request: ChangeRequest) -> ReplayStatus:
        """Play, pause, scrub, set speed, loop and range."""
        player.change(**request.model_dump())
        return player.status()

    @router.delete("")
    def close_replay() -> ReplayStatus:
        """Show the live stage again."""
        player.close_clip()
        return player.status()

    @router.get("/space")
    def get_space() -> Space:
        """Outermost points of the replayed motion, for a page that shows all of it."""
        return Space(points_m=player.space_m().tolist())

    @router.get("/joints")
    def get_joints(
        frame: Annotated[int, Query(ge=0, description="the last one where there are fewer")],
    ) -> Joints:
        """Joints of the replayed motion at a frame, for a page in which one is clicked."""
        poses = player.shown()[0].poses
        places = poses.positions_m[min(frame, poses.frame_count - 1)]
        known = np.isfinite(places).all(axis=1)
        named = zip(OUTPUT_JOINTS, places.tolist(), known, strict=True)
        return Joints(positions_m={name: tuple(place) for name, place, there in named if there})

    @router.get("/curves")
    def get_curves(
        joint: Annotated[str, Query(description="an output joint", examples=["LeftHand"])] = "Hips",
        points: Annotated[int, Query(ge=2, le=20_000)] = MAX_POINTS,
    ) -> Curves:
        """Curves of one joint of the replayed solve, for the timeline."""
        clip = player.clip
        if clip is None:
            raise SettingsError("replay.nothing", "nothing is replayed; open a take first")
        return curves(clip, joint, points)

    @router.get("/joint_curves")
    def get_joint_curves(
        curve: Annotated[
            list[str],
            Query(
                description=f"up to {MAX_CURVES} of a joint and a channel: {', '.join(CHANNELS)}",
                examples=[["LeftHand.position_y"]],
            ),
        ],
        first: Annotated[int, Query(ge=0)] = 0,
        last: Annotated[int | None, Query(ge=0)] = None,
        points: Annotated[int, Query(ge=2, le=20_000)] = 3000,
    ) -> JointCurves:
        """Curves of several joints of the replayed solve, from frame `first` to `last`, for the graphs of the
        timeline."""
        clip, beside = player.shown()
        return columns.curves(clip, curve, first=first, last=last, points=points, beside=beside)

    return router
