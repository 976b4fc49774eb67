"""Videos of one performance: a folder with a file per camera, or one file. They become landmarks."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from studio.engine.base.errors import FormatError
from studio.engine.base.sentences import say
from studio.engine.base.system import core_count
from studio.engine.model.joints import JOINT_SETS
from studio.engine.seeing.pictures.bundle import model_file
from studio.engine.seeing.pictures.described import is_description
from studio.take.importers.camera_folders import read_beside
from studio.take.importers.recording import Progress, ReadCamera, ReadRecording, ReadVideo
from studio.take.video.file import ENDINGS, is_video
from studio.take.video.landmarks import JOINT_SET, VideoLandmarks
from studio.take.video.sync.clocks import VideoClock
from studio.take.video.sync.find import find_sync
from studio.wire import is_camera_name
from studio.worker.several import run_several

DEVICE = "video, BlazePose"
MODEL = "full"
"""The default model."""

_SYNC_SHARE = 0.05
"""Share of the reading time for bringing videos to one clock."""


def matches(path: Path) -> bool:
    """Whether `path` is a video or a folder with one."""
    return is_video(path) or (path.is_dir() and any(is_video(file) for file in path.iterdir()))


def video_files(path: Path) -> dict[str, Path]:
    """Return the videos at a path by the names of their cameras, those of the files.

    Raises:
        FormatError: two cameras would have one name.
    """
    files = sorted(file for file in path.iterdir() if is_video(file)) if path.is_dir() else [path]
    named = [(camera_name(file), file) for file in files]
    if len(dict(named)) < len(named):
        raise FormatError(
            "import.one_name",
            "{path}: two cameras would have one name of {names}; rename the files",
            path=path,
            names=[name for name, _ in named],
        )
    return dict(named)


def read(
    path: Path,
    progress: Progress,
    model: str | Path = MODEL,
    hands: bool = True,
    sync: str = "auto",
    clap_at_s: Mapping[str, float] | None = None,
) -> ReadRecording:
    """Return the landmarks of videos; several are read at once if there are enough cores.

    Args:
        path: a video, or a folder of them.
        progress: receives the share done.
        model: see `PoseFinder`.
        hands: look for the hands too.
        sync, clap_at_s: see `find_sync`.

    Raises:
        SettingsError: no such model, or no such way of bringing videos to one clock.
        FormatError: a file that is no video, two cameras of one name, videos that cannot be brought to one clock in
            the requested way, or nobody in any video.
        NotAvailableError: LiteRT is not installed.
    """
    model_file(model)
    files = video_files(path)
    found_sync = find_sync(
        files, sync, clap_at_s=clap_at_s, progress=lambda share: progress(_SYNC_SHARE * share)
    )
    found: dict[str, VideoLandmarks] = run_several(
        "studio.take.video.landmarks:landmarks_of",
        {name: (file, model, hands) for name, file in files.items()},
        processes=core_count(),
        progress=lambda share: progress(_SYNC_SHARE + (1.0 - _SYNC_SHARE) * share),
    )
    notes: list[str] = [note for name, one in found.items() for note in _notes(name, one)]
    if not any(one.somebody.any() for one in found.values()):
        raise FormatError("import.nobody", "nobody was found in the videos at {path}", path=path)
    cameras = tuple(_camera(name, one, found_sync.clocks[name], model) for name, one in found.items())
    created = min((one.video.created for one in found.values() if one.video.created), default=None)
    others = _others(path, files)
    if others:
        notes.append(f"left out, as they are no videos: {', '.join(others)}; import them apart")
    notes += found_sync.notes
    return read_beside(path if path.is_dir() else path.parent, cameras, notes, created=created)


def _others(path: Path, files: dict[str, Path]) -> list[str]:
    """Return the names of recordings of another kind next to the videos."""
    if not path.is_dir():
        return []
    taken = set(files.values())
    kinds = (*ENDINGS, ".bag", ".db3", ".mcap")
    return sorted(file.name for file in path.iterdir() if file.suffix.lower() in kinds and file not in taken)


def _camera(name: str, found: VideoLandmarks, clock: VideoClock, model: str | Path) -> ReadCamera:
    count = len(JOINT_SETS[JOINT_SET])
    return ReadCamera(
        name=name,
        device=f"video, {Path(model).stem}" if is_description(model) else DEVICE,
        joint_set=JOINT_SET,
        times_ns=clock.of(found.times_ns),
        positions=np.full((len(found.times_ns), count, 3), np.nan),
        confidence=found.visibility,
        landmarks=found.pictures,
        clock_within_s=clock.within_s,
        video=ReadVideo(found.video.path, found.times_ns),
    )


def _notes(name: str, found: VideoLandmarks) -> list[str]:
    video = found.video
    width, height = found.pictures[0].width, found.pictures[0].height
    gaps_s = np.diff(found.times_ns) * 1e-9
    rate = 1.0 / np.median(gaps_s) if len(gaps_s) else video.frames_per_second
    facts = [
        f"{name}: {video.path.name}, {len(found.pictures)} frames of {width} x {height} at {rate:.4g} Hz, "
        f"somebody in {found.somebody.mean():.0%}",
    ]
    facts += [f"{name}: recorded at {video.created}"] if video.created else []
    facts += [f"{name}: begins at timecode {video.timecode}"] if video.timecode else []
    facts += [video.damage] if video.damage else []
    if found.most_people > 1:
        facts.append(
            say(
                "import.several_people",
                "{name}: {n} people are in the picture; the one nearest to its middle was followed",
                name=name,
                n=found.most_people,
            )
        )
    return facts


def camera_name(file: Path) -> str:
    """Return a file's name without its ending, as the name of a camera."""
    name = re.sub(r"[^A-Za-z0-9_.-]+", "_", file.stem).lstrip("_.-")[:63]
    return name if is_camera_name(name) else f"camera_{file.stem.encode().hex()[:16]}"
