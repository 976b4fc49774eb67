"""Imports of other recordings: `import_recording` finds the kind and the importer that reads it.

`recording` holds the result of an importer and writes it as a take. The importers are `camera_folders` (which reads
`joints_csv` and `depth_folder`), `kinect_v2` (its CSV of one sensor and of two), `k4a_mkv`, `ros_bag` (on
`bag_files`), `recording_files`, `raw_file`, `videos`, which finds landmarks, and `keypoints`, which reads those of
other programs. `table` reads CSV, and `k4a` the metadata of Azure Kinect files.
`animation` makes takes of animations, without raw.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from studio.engine.base.errors import FormatError, SettingsError, TakeError
from studio.engine.base.sentences import say
from studio.take.folder.take import Take, check_free
from studio.take.importers import (
    camera_folders,
    k4a_mkv,
    raw_file,
    recording_files,
    ros_bag,
    videos,
)
from studio.take.importers.animation import ANIMATIONS, import_animation, is_animation
from studio.take.importers.keypoints import reading as keypoints
from studio.take.importers.kinect_v2 import pair, states
from studio.take.importers.recording import Progress, ReadRecording, write_recording


@dataclass(frozen=True)
class Importer:
    """One kind of recording: its name, the test whether a path is one, and its reader."""

    description: str
    matches: Callable[[Path], bool]
    read: Callable[[Path, Progress], ReadRecording]
    share: float = 0.3
    """Share of an import's time for reading; the rest is for writing."""


IMPORTERS: dict[str, Importer] = {
    "camera-folders": Importer(
        say("import.kind_camera_folders", "a folder with camera_K/joints.csv or camera_K/depth.txt"),
        camera_folders.matches,
        camera_folders.read,
    ),
    "kinect-pair": Importer(
        say(
            "import.kind_kinect_pair",
            "a CSV of several Kinect v2 with the columns Kinect_Id and Skeleton_Time",
        ),
        pair.matches,
        pair.read,
    ),
    "kinect-states": Importer(
        say(
            "import.kind_kinect",
            "a CSV of one Kinect v2 without a header: time in 100 ns, then x, y, z, state of 25 joints",
        ),
        states.matches,
        states.read,
    ),
    "keypoint-folders": Importer(
        say(
            "import.kind_keypoints",
            "a folder with the landmarks of OpenPose, MMPose, AlphaPose, Pose2Sim or FreeMoCap, per camera",
        ),
        keypoints.matches,
        keypoints.read,
    ),
    "videos": Importer(
        say("import.kind_videos", "a video, or a folder of videos, one per camera"),
        videos.matches,
        videos.read,
        share=0.97,
    ),
    "k4a-mkv": Importer(
        say("import.kind_k4a", "an Azure Kinect recording (.mkv)"), k4a_mkv.matches, k4a_mkv.read
    ),
    "ros-bag": Importer(
        say("import.kind_ros", "a RealSense or ROS recording (.bag, .db3)"), ros_bag.matches, ros_bag.read
    ),
    "recording-files": Importer(
        say("import.kind_several", "a folder of such recordings, one per camera"),
        recording_files.matches,
        recording_files.read,
    ),
    "raw-file": Importer(
        say("import.kind_raw", "a raw recording of the studio (.mcap)"), raw_file.matches, raw_file.read
    ),
}
"""Kinds of recordings by name, in the order of their tests."""


def import_recording(
    path: str | Path,
    out: str | Path,
    *,
    unit_m: float | None = None,
    model: str | Path | None = None,
    hands: bool = True,
    sync: str | None = None,
    clap_at_s: Mapping[str, float] | None = None,
    keep_videos: bool = True,
    progress: Progress | None = None,
) -> Take:
    """Return a new take at `out` with the recording or animation at `path`; its notes state the choices made.

    An animation makes a take without raw, with the solve `imported`.

    Args:
        path: a file or folder of a kind in `IMPORTERS`, or a file for which `animation.is_animation` is true.
        out: the take's folder; must not exist or be empty.
        unit_m: metres per unit of a BVH; None = its rest pose is 1.75 m high.
        model: finds the landmarks in videos: `lite`, `full`, `heavy`, or a file; None = `full`.
        hands: look for the hands in videos too.
        sync: how videos are brought to one clock, see `find_sync`; None = `auto`.
        clap_at_s: about when a clap is heard in a camera's video [s], see `find_sync`.
        keep_videos: the take keeps the videos that it is read from, so that the replay shows them.
        progress: called with 0..1.

    Raises:
        FormatError: no recording there, of no known kind, or damaged; names the file, line and column.
        NotAvailableError: the package of an optional reader is not installed.
        SettingsError: a unit for a file that states its own, or an option of videos for another kind.
        TakeError: `out` is not empty. No error leaves files behind.
    """
    path, out = Path(path), Path(out)
    options = {"model": model, "sync": sync, "clap_at_s": clap_at_s or None}
    options = {name: value for name, value in options.items() if value is not None}
    if path.is_file() and is_animation(path):
        if options:
            raise _only_videos(options)
        return import_animation(path, out, unit_m=unit_m, progress=progress or _silent)
    if unit_m is not None:
        raise SettingsError("import.unit", "a unit of {m:g} m: only a BVH takes one; leave it out", m=unit_m)
    importer = _importer(path)
    reader = importer.read
    if options:
        if reader not in (videos.read, keypoints.read):
            raise _only_videos(options)
        reader = partial(reader, **options)
    if importer.read is videos.read:
        reader = partial(reader, hands=hands)
    check_free(out)
    report = progress or _silent
    reading = importer.share
    recording = reader(path, lambda done: report(reading * done))
    take = write_recording(
        recording, out, lambda done: report(reading + (1.0 - reading) * done), keep_videos=keep_videos
    )
    report(1.0)
    return take


def are_videos(path: Path) -> bool:
    """Whether an import reads a path as videos, or as landmarks that another program found in videos."""
    found = next((one for one in IMPORTERS.values() if one.matches(path)), None)
    return found is not None and found.read in (videos.read, keypoints.read)


def _only_videos(options: Mapping[str, object]) -> SettingsError:
    names = {"model": "--model", "sync": "--sync", "clap_at_s": "--clap-at"}
    return SettingsError(
        "import.only_videos",
        "{options}: only for videos; leave it out",
        options=[names[name] for name in options],
    )


def _silent(_share: float) -> None:
    pass


def _importer(path: Path) -> Importer:
    if not path.exists():
        raise FormatError("import.none", "no recording at {path}: there is no such file or folder", path=path)
    if (path / "take.json").is_file():
        raise TakeError("import.is_take", "{path} is a take already; use it as it is", path=path)
    for importer in IMPORTERS.values():
        if importer.matches(path):
            return importer
    raise not_importable(path)


def not_importable(path: str | Path) -> FormatError:
    """Return the error for a path of no known kind, with the known kinds."""
    kinds = [*(importer.description for importer in IMPORTERS.values()), ANIMATIONS]
    return FormatError(
        "import.unknown_kind",
        "{path} is no recording that can be imported; allowed: {kinds}",
        path=path,
        kinds=kinds,
    )
