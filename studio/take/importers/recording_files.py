"""A folder of recordings of single cameras (`.mkv`, `.bag`, `.db3`): one camera per depth stream."""

from dataclasses import replace
from pathlib import Path

from studio.engine.base.errors import FormatError
from studio.take.importers import k4a_mkv, ros_bag
from studio.take.importers.camera_folders import read_beside
from studio.take.importers.recording import Progress, ReadCamera, ReadRecording
from studio.wire import is_camera_name

_ENDINGS = (".mkv", ".bag", ".db3")


def matches(path: Path) -> bool:
    """Whether `path` is a folder with such a file."""
    return path.is_dir() and bool(_files(path))


def read(path: Path, progress: Progress) -> ReadRecording:
    """Return the recording; a camera is named after its file if that is a valid name, else `camera_K`.

    Raises:
        FormatError: a file that cannot be read, or two cameras of one name.
    """
    cameras: list[ReadCamera] = []
    notes: list[str] = []
    created = []
    files = _files(path)
    for k, file in enumerate(files):
        if file.suffix.lower() == ".mkv":
            found, when = k4a_mkv.read_cameras(file, notes)
            created += [when] if when else []
        else:
            found = ros_bag.read_cameras(file, notes)
        for number, camera in enumerate(found):
            of_file = file.stem if len(found) == 1 else f"{file.stem}_{number}"
            name = of_file if is_camera_name(of_file) else f"camera_{len(cameras)}"
            notes.append(f"{name}: {file.name}, its {camera.name}")
            cameras.append(replace(camera, name=name))
        progress((k + 1) / len(files))
    names = [camera.name for camera in cameras]
    if len(set(names)) < len(names):
        raise FormatError(
            "import.one_name",
            "{path}: two cameras would have one name of {names}; rename the files",
            path=path,
            names=[*names],
        )
    return read_beside(path, tuple(cameras), notes, created=min(created, default=None))


def _files(path: Path) -> list[Path]:
    return sorted(file for file in path.iterdir() if file.is_file() and file.suffix.lower() in _ENDINGS)
