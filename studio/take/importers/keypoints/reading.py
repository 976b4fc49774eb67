"""Landmarks of other programs as cameras of a recording."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.base.sentences import say
from studio.engine.base.system import core_count
from studio.take.importers.camera_folders import read_beside
from studio.take.importers.keypoints import freemocap, mmpose, openpose
from studio.take.importers.keypoints.film import Film, film_of, videos_beside
from studio.take.importers.keypoints.people import follow
from studio.take.importers.keypoints.points import Detections, has_feet, to_blazepose
from studio.take.importers.recording import Progress, ReadCamera, ReadRecording
from studio.take.importers.videos import MODEL
from studio.take.video.landmarks import JOINT_SET, LANDMARKS, VideoLandmarks
from studio.take.video.sync.find import FoundSync, find_sync
from studio.wire import LandmarkArrays
from studio.worker.several import run_several

DEVICE = "landmarks of another program"

_NEAR = 0.25
"""Maximum distance between the studio's body and the landmarks' if they are one person, as a share of its height in
the picture."""
_GUESS_SHARE = 0.8
_SAME_NS = 2_000_000


def matches(path: Path) -> bool:
    """Whether `path` is a folder with landmarks of one of the forms."""
    return path.is_dir() and bool(camera_sources(path))


def camera_sources(path: Path) -> dict[str, Callable[[], Detections]]:
    """Return the reader of landmarks of each camera."""
    for form in (openpose, mmpose):
        found = form.cameras(path)
        if found:
            return {name: partial(form.read, one) for name, one in found.items()}
    array = freemocap.array_of(path)
    if array is None:
        return {}
    count = _cameras_in(array)
    names = [*videos_beside(path)]
    if len(names) != count:
        names = [f"cam_{k}" for k in range(count)]
    return {name: partial(_camera_of, array, k) for k, name in enumerate(names)}


def _camera_of(array: Path, k: int) -> Detections:
    return freemocap.read(array)[k]


def _cameras_in(array: Path) -> int:
    try:
        shape = np.load(array, mmap_mode="r", allow_pickle=False).shape
    except (OSError, ValueError, EOFError):
        return 1  # reading it reports what is wrong
    return int(shape[0]) if len(shape) == 4 else 1


def read(
    path: Path,
    progress: Progress,
    model: str | Path = MODEL,
    sync: str | None = None,
    clap_at_s: Mapping[str, float] | None = None,
) -> ReadRecording:
    """Return the landmarks of all cameras.

    If a camera's video exists, the studio's own network estimates from it the body's pose in space. Calibration
    needs this pose, and landmarks in a picture do not give it.

    Args:
        path: folder with the landmarks.
        progress: receives the share done.
        model: of the studio's own network, see `PoseFinder`.
        sync, clap_at_s: see `find_sync`; None = `none` if all landmarks are of one clock, else `auto`, or `motion`
            without videos.

    Raises:
        SettingsError: no such model, or no such way of bringing videos to one clock.
        FormatError: a damaged file, points of an unknown kind, neither a video nor times, or videos that cannot
            be brought to one clock in the requested way.
    """
    videos = videos_beside(path)
    found = {name: one() for name, one in camera_sources(path).items()}
    films = {
        name: film_of(path, name, videos.get(name), max(one.frames, default=0) + 1, one.size)
        for name, one in found.items()
    }
    synced = _sync(films, found, sync, clap_at_s)
    guesses = _guesses(films, model, lambda share: progress(_GUESS_SHARE * share))
    notes: list[str] = []
    cameras = []
    for k, (name, one) in enumerate(found.items()):
        camera = _camera(name, one, films[name], guesses.get(name), notes)
        clock = synced.clocks[name]
        cameras.append(replace(camera, times_ns=clock.of(camera.times_ns), clock_within_s=clock.within_s))
        progress(_GUESS_SHARE + (1.0 - _GUESS_SHARE) * (k + 1) / len(found))
    notes += synced.notes
    lenses = sorted(path.glob(freemocap.CALIBRATION))
    if lenses:
        notes.append(
            say(
                "import.keypoints_lenses",
                "{file} was left: cameras are calibrated anew; give its lenses with studio calibrate --lens",
                file=lenses[0].name,
            )
        )
    return read_beside(path, tuple(cameras), notes)


def _sync(
    films: Mapping[str, Film],
    found: Mapping[str, Detections],
    sync: str | None,
    clap_at_s: Mapping[str, float] | None,
) -> FoundSync:
    videos = {name: film.video for name, film in films.items() if film.video is not None}
    if all(one.together for one in found.values()) and sync is None:
        return find_sync({name: one.path for name, one in found.items()}, "none")
    if len(videos) == len(films):
        return find_sync(videos, sync or "auto", clap_at_s=clap_at_s)
    if sync not in (None, "motion", "none"):
        raise FormatError(
            "sync.no_videos",
            "{names}: landmarks without their videos are not brought to one clock by {way}; choose motion or none",
            names=[name for name in films if name not in videos],
            way=sync,
        )
    return find_sync({name: one.path for name, one in found.items()}, sync or "motion")


def _guesses(films: Mapping[str, Film], model: str | Path, progress: Progress) -> dict[str, VideoLandmarks]:
    """Return the landmarks that the studio's own network finds in the videos."""
    works = {name: (film.video, model, False) for name, film in films.items() if film.video is not None}
    if not works:
        return {}
    return run_several(
        "studio.take.video.landmarks:landmarks_of", works, processes=core_count(), progress=progress
    )


def _camera(
    name: str, found: Detections, film: Film, guess: VideoLandmarks | None, notes: list[str]
) -> ReadCamera:
    numbers = sorted(found.frames)
    first = 0 if max(numbers, default=0) < len(film.times_ns) else min(numbers)  # some programs count from 1
    numbers = [number for number in numbers if 0 <= number - first < len(film.times_ns)]
    times_ns = film.times_ns[np.array(numbers, np.int64) - first]
    people, most = follow(found, (film.width, film.height))
    pictures, visibility = [], np.zeros((len(numbers), LANDMARKS))
    for k, number in enumerate(numbers):
        pixels = np.full((LANDMARKS, 2), np.nan)
        if number in people:
            pixels, visibility[k] = to_blazepose(people[number])
        world_m = None if guess is None else _world(guess, int(times_ns[k]), pixels)
        pictures.append(LandmarkArrays(film.width, film.height, pixels, world_m))
    _note(name, found, people, most, numbers, guess, notes)
    return ReadCamera(
        name=name,
        device=DEVICE,
        joint_set=JOINT_SET,
        times_ns=times_ns,
        positions=np.full((len(numbers), LANDMARKS, 3), np.nan),
        confidence=visibility,
        landmarks=pictures,
    )


def _world(guess: VideoLandmarks, time_ns: int, pixels: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the body's pose from the studio's own network; None where that saw nobody, or somebody else."""
    k = int(np.argmin(np.abs(guess.times_ns - time_ns)))
    seen = guess.pictures[k]
    both = np.isfinite(pixels).all(axis=1) & np.isfinite(seen.pixels).all(axis=1)
    if abs(int(guess.times_ns[k]) - time_ns) > _SAME_NS or seen.world_m is None or not both.any():
        return None
    apart = np.linalg.norm(seen.pixels[both] - pixels[both], axis=1)
    height = float(np.ptp(seen.pixels, axis=0).max())
    return seen.world_m if float(np.median(apart)) < _NEAR * height else None


def _note(
    name: str,
    found: Detections,
    people: Mapping[int, NDArray[np.float64]],
    most: int,
    numbers: list[int],
    guess: VideoLandmarks | None,
    notes: list[str],
) -> None:
    share = len(people) / max(len(numbers), 1)
    notes.append(
        f"{name}: {len(numbers)} frames of landmarks from {found.path.name}, somebody in {share:.0%}"
    )
    if most > 1:
        notes.append(
            say(
                "import.keypoints_people",
                "{name}: up to {n} people in a frame; who was large for the longest was followed, in {share:.0f} % "
                "of the frames",
                name=name,
                n=most,
                share=100.0 * share,
            )
        )
    if people and not has_feet(next(iter(people.values()))):
        notes.append(
            say(
                "import.keypoints_no_feet",
                "{name}: its landmarks have no heels and toes: the floor is where the ankles say, feet are guessed",
                name=name,
            )
        )
    if guess is None:
        notes.append(
            say(
                "import.keypoints_flat",
                "{name}: without its video nothing tells how the body stands, and it cannot be calibrated: "
                "put the video into videos/, or a calibration.json beside it",
                name=name,
            )
        )
