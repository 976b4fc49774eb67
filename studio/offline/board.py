"""A board in the videos of a take, which gives its calibration scale, floor and origin."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import CalibrationError, SettingsError
from studio.engine.calibration.board import BoardFound, Sighting, with_board
from studio.engine.calibration.calibrate import with_performer
from studio.engine.calibration.quality.verdict import HEIGHTS_M, in_shoes
from studio.engine.model.calibration import Calibration
from studio.engine.model.cameras.lens import Lens
from studio.engine.seeing.board import Board, BoardFinder, SeenBoard
from studio.take.folder.take import Take
from studio.take.raw.frames import camera_frames
from studio.take.video.file import VideoFile
from studio.take.video.kept import KeptVideo, kept_videos
from studio.take.video.picture import whole_picture

Progress = Callable[[float], None]

MOST_INSTANTS, STEP_S = 80, 0.5
"""Maximum number of instants of a take whose pictures are searched, and their least distance [s]."""

_NEAR_S, _SEARCHED_S = 0.02, 3.0
_SIDE = 1920
"""Pictures with a longer side are halved."""

_LARGEST_DIFFERENCE = 0.08
"""Largest relative difference of the performer's height from the given one."""


def calibrated_by_board(
    take: Take,
    calibration: Calibration,
    board: Board,
    *,
    height_m: float | None = None,
    progress: Progress | None = None,
) -> tuple[Calibration, BoardFound]:
    """Return a calibration with the size of a board that the take's videos show, and the facts about the board.

    Args:
        take: with videos.
        calibration: of the take, not yet stored.
        height_m: the performer's without shoes, if it was given; it must agree.
        progress: receives the share done.

    Raises:
        SettingsError: cameras with depth, which know the size, or a take without videos.
        CalibrationError: the board was not found, not by two cameras at once, or gives the performer a wrong height.
        NotAvailableError: OpenCV is not installed.
    """
    if any(camera.lens is None for camera in calibration.cameras.values()):
        raise SettingsError(
            "board.depth", "cameras with depth know the size of the stage: calibrate without --board"
        )
    videos = {name: mine for name, mine in kept_videos(take.path).items() if name in calibration.cameras}
    if len(videos) < 2:
        raise SettingsError(
            "board.no_videos",
            "a board is found in the videos of at least two cameras, and {take} keeps {n}: record with videos, or "
            "import the videos",
            take=take.path,
            n=len(videos),
        )
    found, said = with_board(calibration, _sightings(videos, calibration, board, progress))
    performer = _measured(take, found)
    if performer.performer is not None:
        _check_height(performer.performer.height_m, in_shoes(height_m))
    return _without_guess(performer), said


def _measured(take: Take, calibration: Calibration) -> Calibration:
    """The calibration with its performer measured again, over the floor that it has now."""
    again = with_performer(replace(calibration, performer=None), camera_frames(take.raw_path))
    return calibration if again.performer is None else again


def _check_height(found_m: float, given_m: float | None) -> None:
    if given_m is not None and abs(found_m / given_m - 1.0) > _LARGEST_DIFFERENCE:
        raise CalibrationError(
            "board.height_differs",
            "by the board the performer is {found:.2f} m tall, and {given:.2f} m was given: measure the board's "
            "squares again",
            found=found_m,
            given=given_m,
        )
    if not HEIGHTS_M[0] <= found_m <= HEIGHTS_M[1]:
        raise CalibrationError(
            "board.no_human",
            "by the board the performer is {found:.2f} m tall, which nobody is: measure the board's squares again",
            found=found_m,
        )


def _without_guess(calibration: Calibration) -> Calibration:
    """The calibration without the reason that its size is guessed."""
    cameras = {
        name: replace(
            camera,
            reasons=tuple(one for one in camera.reasons if getattr(one, "code", "") != "views.size_guessed"),
        )
        for name, camera in calibration.cameras.items()
    }
    return replace(calibration, cameras=cameras)


def _sightings(
    videos: dict[str, list[KeptVideo]], calibration: Calibration, board: Board, progress: Progress | None
) -> list[Sighting]:
    """All cameras' sightings at common instants."""
    times = {
        name: np.concatenate([_stage_s(calibration, name, one) for one in mine])
        for name, mine in videos.items()
    }
    first_s, last_s = (
        sorted(edge(mine) for mine in times.values())[place] for edge, place in ((np.min, 1), (np.max, -2))
    )
    count = int(np.clip((last_s - first_s) / STEP_S, 1, MOST_INSTANTS))
    slowest = min(times.values(), key=len)  # its pictures are the instants
    wanted = np.linspace(first_s, last_s, count)
    instants = slowest[np.unique(np.abs(slowest[None] - wanted[:, None]).argmin(axis=1))]
    finder, out, other = BoardFinder(board), list[Sighting](), ""
    for done, (name, mine) in enumerate(videos.items()):
        lens = calibration.cameras[name].lens
        assert lens is not None
        for looked, (instant, grey) in enumerate(_pictures(mine, times[name], instants)):
            seen = finder.find(grey)
            out += [Sighting(name, instant, _in_lens(one, grey, lens)) for one in seen]
            if not seen and not out and not other:
                other = finder.others(grey)
            if progress is not None:
                progress((done + (looked + 1) / count) / len(videos))
    if not out:
        raise _not_found(board, finder.markers, other)
    if len({one.camera for one in out}) < 2:
        raise CalibrationError(
            "board.one_camera",
            "only {name} saw the board: lay it where two cameras see it, as large as they can",
            name=out[0].camera,
        )
    return out


def _stage_s(calibration: Calibration, name: str, video: KeptVideo) -> NDArray[np.float64]:
    clock = calibration.cameras[name].clock
    return np.array([clock.stage_ns(time_ns) for time_ns in video.times_ns.tolist()]) * 1e-9


def _not_found(board: Board, markers: int, other: str) -> CalibrationError:
    if markers:
        return CalibrationError(
            "board.no_corners",
            "markers of {dictionary} were seen in {n} pictures, but no board of {columns} x {rows} squares: count "
            "its squares, columns first",
            dictionary=board.dictionary,
            n=markers,
            columns=board.columns,
            rows=board.rows,
        )
    if other:
        return CalibrationError(
            "board.other_markers",
            "no marker of {dictionary} was seen, but some of {other}: name the board's own dictionary",
            dictionary=board.dictionary,
            other=other,
        )
    return CalibrationError(
        "board.not_found",
        "no board was seen in any video: show it to two cameras, larger, flat and in light",
    )


def _pictures(
    videos: Sequence[KeptVideo], stage_s: NDArray[np.float64], instants: NDArray[np.float64]
) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    """A camera's pictures at instants, as number of the instant and grey picture; instants without one are left
    out."""
    begin = 0
    for video in videos:
        mine = stage_s[begin : begin + len(video.at_ns)]
        begin += len(mine)
        nearest = np.abs(mine[None] - instants[:, None]).argmin(axis=1)
        near = np.abs(mine[nearest] - instants) < _NEAR_S
        wanted = {int(video.at_ns[nearest[k]]): int(k) for k in np.flatnonzero(near)}
        yield from _wanted(video, wanted)


def _wanted(video: KeptVideo, wanted: dict[int, int]) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    """Pictures at times of a video [ns], each with the number that `wanted` has for it."""
    left = sorted(wanted)
    file = VideoFile.open(video.path)
    while left:
        from_ns = left[0]
        for at_ns, frame in file.frames(from_ns=max(from_ns - round(_SEARCHED_S * 1e9), 0)):
            while left and left[0] < at_ns:
                left.pop(0)
            if not left:
                return
            if at_ns == left[0]:
                yield wanted[left.pop(0)], whole_picture(frame, _SIDE)
                if left and left[0] - at_ns > 2e9 * _SEARCHED_S:
                    break  # search for the next
        else:
            return


def _in_lens(seen: SeenBoard, grey: NDArray[np.uint8], lens: Lens) -> SeenBoard:
    """A sighting with pixels of pictures of the lens's size."""
    by = np.array([lens.width / grey.shape[1], lens.height / grey.shape[0]])
    return replace(seen, pixels=(seen.pixels + 0.5) * by - 0.5)
