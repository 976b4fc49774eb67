"""Routes of the videos next to the replay: cameras with a video, its pictures, and what is drawn over them."""

import threading
from collections import OrderedDict
from pathlib import Path
from typing import Annotated, Protocol
from zlib import crc32

from fastapi import APIRouter, Query
from fastapi.responses import Response
from msgspec import Struct

from studio.api.errors import NotFoundError
from studio.api.structs import StructRoute
from studio.engine.base.sentences import Said, say
from studio.take.folder.take import Take
from studio.take.video.kept import FOLDER, KeptVideo, kept_videos, numbered
from studio.take.video.seen import VideoSeen, video_seen
from studio.take.video.stills import Stills
from studio.web.playback.clip import Clip
from studio.web.playback.player import Player
from studio.web.playback.video import Drawn, PlaceInPicture, ReplayedVideo, VideoShown

WIDEST = 1920
_REMEMBERED = 8
_CACHED = {"Cache-Control": "private, max-age=600"}

_Stamp = tuple[tuple[str, int], ...]


class TakeOpener(Protocol):
    """Finds takes."""

    def take(self, session: str, name: str) -> Take:
        """Return a take."""
        ...


class CameraWithVideo(Struct):
    """A camera of the replayed take; `why`: why its video cannot be shown, "" = it can."""

    name: str
    why: str


class VideosOfTake(Struct):
    """The cameras of the replayed take, and a stamp that changes with its videos."""

    take: str
    stamp: str
    cameras: list[CameraWithVideo]


class Videos:
    """The videos of takes, as far as they have been read; usable from any thread."""

    def __init__(self) -> None:
        self.stills = Stills()
        self._lock = threading.Lock()
        self._kept: OrderedDict[Path, tuple[_Stamp, dict[str, list[KeptVideo]]]] = OrderedDict()
        self._seen: OrderedDict[tuple[Path, str], tuple[_Stamp, VideoSeen]] = OrderedDict()

    def kept(self, take: Take) -> dict[str, list[KeptVideo]]:
        """Return a take's videos by camera."""
        stamp = _stamp(take)
        with self._lock:
            found = self._kept.get(take.path)
            if found is None or found[0] != stamp:
                found = stamp, kept_videos(take.path)
                _remember(self._kept, take.path, found)
            return found[1]

    def seen(self, take: Take, camera: str) -> VideoSeen:
        """Return a camera's pictures and landmarks.

        Raises:
            NotFoundError: the take keeps no video of it.
        """
        videos, stamp = self.of_camera(take, camera), _stamp(take)
        with self._lock:
            found = self._seen.get((take.path, camera))
            if found is None or found[0] != stamp:
                found = stamp, video_seen(take, videos)
                _remember(self._seen, (take.path, camera), found)
            return found[1]

    def of_camera(self, take: Take, camera: str) -> list[KeptVideo]:
        """Return the videos of a camera, one at least.

        Raises:
            NotFoundError: there is none.
        """
        videos = self.kept(take).get(camera)
        if not videos:
            raise NotFoundError(_none(camera))
        return videos


def video_routes(player: Player, takes: TakeOpener, videos: Videos) -> APIRouter:
    """Return the routes."""
    router = APIRouter(prefix="/api/v1", tags=["replay"], route_class=StructRoute)

    def replayed() -> tuple[Clip, Take]:
        clip = player.shown()[0]
        session, _, name = clip.take.partition("/")
        return clip, takes.take(session, name)

    def video_of(camera: str) -> ReplayedVideo:
        clip, take = replayed()
        return ReplayedVideo.of(clip, camera, videos.seen(take, camera))

    @router.get("/replay/video")
    def get_videos() -> VideosOfTake:
        """The cameras of the replayed take, and whether there is a video of each."""
        clip, take = replayed()
        kept = videos.kept(take)
        names = dict.fromkeys((*take.camera_names, *kept))
        cameras = [CameraWithVideo(name, "" if name in kept else _none(name)) for name in names]
        return VideosOfTake(clip.take, f"{crc32(repr(_stamp(take)).encode()):08x}", cameras)

    @router.get("/replay/video/{camera}")
    def get_video(camera: str) -> VideoShown:
        """The picture of each frame of the replay, and what can be drawn over them."""
        return video_of(camera).shown()

    @router.get("/replay/video/{camera}/drawn")
    def get_drawn(
        camera: str, first: Annotated[int, Query(ge=0)] = 0, last: Annotated[int, Query(ge=0)] = 0
    ) -> Drawn:
        """Landmarks and solved skeleton in the pictures from place `first` to `last` of their order, 600 at most."""
        return video_of(camera).drawn(first, last)

    @router.get("/replay/video/{camera}/place")
    def get_place(
        camera: str,
        picture: Annotated[int, Query(ge=0, description="number of the picture")],
        x: Annotated[float, Query(ge=0.0, le=1.0, description="share of the picture's width")],
        y: Annotated[float, Query(ge=0.0, le=1.0, description="share of its height")],
        near_x: Annotated[float, Query(description="about where the joint is, stage frame [m]")],
        near_y: float,
        near_z: float,
    ) -> PlaceInPicture:
        """Position of a joint seen at a place in a picture: on the ray there, as near as possible to its assumed
        position. This is how a joint is pinned in a picture."""
        return video_of(camera).place(picture, x, y, (near_x, near_y, near_z))

    @router.get("/takes/{session}/{take}/video/{camera}/pictures/{number}", response_class=Response)
    def get_picture(
        session: str,
        take: str,
        camera: str,
        number: int,
        width: Annotated[int, Query(ge=16, le=WIDEST, description="largest width [pixels]")] = 960,
    ) -> Response:
        """A picture of a camera's video (JPEG), upright; numbers count through all videos of the camera."""
        try:
            video, at_ns = numbered(videos.of_camera(takes.take(session, take), camera), number)
        except IndexError as error:
            raise NotFoundError(
                "video.no_number", "the video of {name} has no picture {n}", name=camera, n=number
            ) from error
        picture = videos.stills.picture(video.path, at_ns, width)
        return Response(picture, media_type="image/jpeg", headers=_CACHED)

    return router


def _none(camera: str) -> Said:
    return say(
        "video.none_kept",
        "the take keeps no video of {name}: none was recorded, it has not come yet, or it was deleted",
        name=camera,
    )


def _stamp(take: Take) -> _Stamp:
    """Return a stamp that changes with a take's videos and frames."""
    places = [take.raw_path, take.path / FOLDER, *sorted((take.path / FOLDER).glob("*"))]
    return tuple((place.name, place.stat().st_mtime_ns) for place in places if place.exists())


def _remember(kept: OrderedDict, key: object, value: object) -> None:
    kept[key] = value
    kept.move_to_end(key)
    while len(kept) > _REMEMBERED:
        kept.popitem(last=False)
