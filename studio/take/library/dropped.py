"""Grouping of files that are given at once: each group is one recording, animation, take or robot.

Only the paths count; the importers read the content.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from studio.engine.animation.read.files import ENDINGS
from studio.engine.base.sentences import say
from studio.engine.robots.body.named_files import ENDINGS as ROBOTS
from studio.take.folder.names import is_safe_name
from studio.take.importers import not_importable
from studio.take.library.bundle import ENDING
from studio.take.video import file as videos

MAX_DEPTH = 12
MAX_FILE_NAME = 200
"""Characters of a file's or folder's name."""

_OF_A_CAMERA = ("joints.csv", "depth.txt")
_CAMERAS = (".bag", ".db3", *videos.ENDINGS)
_BESIDE = ("calibration.json", "recording.json")
_LANDMARKS = ("pose", "predictions", "output_data")
"""Folders of a project in which other programs store landmarks."""
_ALONE = (".csv", ".mcap", ENDING, *ENDINGS)


_MESHES = (".stl", ".obj", ".dae", ".msh", ".mtl", ".png", ".jpg")
"""Endings of the files of a robot's model that is given with loose files."""


@dataclass(frozen=True)
class Group:
    """Files that make one take, or the robots of one folder.

    Attributes:
        label: its name for people: that of a file or folder.
        root: path of what is imported, below the folder of the files; empty: that folder itself.
        files: their indices in the given list.
        problem: why they cannot be imported; empty if they can.
        robot: whether they are models of robots.
    """

    label: str
    root: str
    files: tuple[int, ...]
    problem: str = ""
    robot: bool = False


def group_files(paths: Sequence[str]) -> list[Group]:
    """Return the takes that files would make, from their paths relative to what was given, `/` between the parts.

    A folder with folders of cameras, a folder with recordings of single cameras, and a folder that is a take make one
    take each; any other folder is searched. Loose recordings of single cameras are one take, as in a folder. Models
    of robots make one group with all files in their folder, loose models with the loose meshes. A loose file of no
    known kind, and a folder with nothing else, has a problem.
    """
    good: dict[int, PurePosixPath] = {}
    groups: list[Group] = []
    for index, text in enumerate(paths):
        problem = _problem(text)
        if problem:
            groups.append(Group(text[:80], text, (index,), problem))
        else:
            good[index] = PurePosixPath(text)
    _search(PurePosixPath("."), good, groups)
    return groups


def _problem(text: str) -> str:
    parts = text.split("/")
    if len(parts) <= MAX_DEPTH and all(is_safe_name(part, MAX_FILE_NAME) for part in parts):
        return ""
    return say(
        "import.name",
        "the name {name!r} is not allowed; allowed: at most {deep} folders deep, each name of 1 "
        'to {most} characters without \\ : * ? " < > |, not beginning with a dot; rename it',
        name=text[:80],
        deep=MAX_DEPTH,
        most=MAX_FILE_NAME,
    )


def _search(folder: PurePosixPath, files: dict[int, PurePosixPath], groups: list[Group]) -> None:
    """Add the takes that a folder's files make."""
    inside = tuple(files)
    loose = {index: path for index, path in files.items() if path.parent == folder}
    names = {path.name.lower() for path in loose.values()}
    label, root = (folder.name, folder.as_posix()) if folder.name else ("", "")
    if folder.name and ("take.json" in names or _has_cameras(folder, files) or _has_landmarks(folder, files)):
        groups.append(Group(label, root, inside))
        return
    cameras = [index for index, path in loose.items() if path.suffix.lower() in _CAMERAS]
    beside = [index for index, path in loose.items() if path.name in _BESIDE]
    if cameras and (folder.name or len(cameras) + len(beside) > 1):
        groups.append(Group(label or loose[cameras[0]].name, root, tuple(sorted(cameras + beside))))
        loose = {index: path for index, path in loose.items() if index not in (*cameras, *beside)}
    before = len(groups)
    if not folder.name and (models := [path for path in loose.values() if _ends(path, ROBOTS)]):
        mine = [index for index, path in loose.items() if _ends(path, (*ROBOTS, *_MESHES))]
        groups.append(Group(models[0].name, "", tuple(mine), robot=True))
        loose = {index: path for index, path in loose.items() if index not in mine}
    for index, path in loose.items():
        if path.name.lower().endswith((*_ALONE, *_CAMERAS)):
            groups.append(Group(path.name, path.as_posix(), (index,)))
        elif not folder.name:
            groups.append(Group(path.name, path.as_posix(), (index,), not_importable(path.name).sentence))
    if (
        len(folder.parts) == 1
        and len(groups) == before
        and any(_ends(path, ROBOTS) for path in files.values())
    ):
        groups.append(Group(label, root, inside, robot=True))
        return
    below: dict[str, dict[int, PurePosixPath]] = {}
    for index, path in files.items():
        if path.parent != folder:
            below.setdefault(path.relative_to(folder).parts[0], {})[index] = path
    for name, mine in below.items():
        _search(folder / name, mine, groups)
    if len(folder.parts) == 1 and not cameras and len(groups) == before:
        groups.append(Group(label, root, inside, not_importable(label).sentence))


def _ends(path: PurePosixPath, endings: tuple[str, ...]) -> bool:
    return path.suffix.lower() in endings


def _has_cameras(folder: PurePosixPath, files: dict[int, PurePosixPath]) -> bool:
    """Whether one of the files marks a camera's folder."""
    return any(
        path.name in _OF_A_CAMERA and path.parent.parent == folder and path.parent.name.startswith("camera_")
        for path in files.values()
    )


def _has_landmarks(folder: PurePosixPath, files: dict[int, PurePosixPath]) -> bool:
    """Whether a folder looks like landmarks of another program: JSON in it, in a folder in it or in a project's
    folders, or FreeMoCap's array."""
    if any(path.name in ("take.json", "camera.json") for path in files.values()):
        return False
    for path in files.values():
        parts = path.relative_to(folder).parts
        near = len(parts) <= 2 or (len(parts) == 3 and parts[0] in _LANDMARKS)
        if path.suffix.lower() == ".json" and path.name not in _BESIDE and near:
            return True
        if path.name.endswith("pixelXY.npy") and (len(parts) == 1 or parts[:1] == _LANDMARKS[-1:]):
            return True
    return False
