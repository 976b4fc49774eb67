"""The trash: removed takes, solves and videos, kept in `sessions/.trash` until restored or deleted.

`.trash/<id>/take` is the take's folder, `.trash/<id>/solve` a solve's, or `.trash/<id>/video` that of its videos;
`.trash/<id>/thrown.json` holds its former place and the time of removal.
"""

import json
import secrets
import shutil
from dataclasses import dataclass
from pathlib import Path

from studio.engine.base.errors import TakeError
from studio.engine.base.files import write_json
from studio.engine.base.sentences import system_says
from studio.take.folder.lock import is_held
from studio.take.folder.names import check_name, inside, is_safe_name
from studio.take.folder.take import Take, check_free, utc_now
from studio.take.library.sessions import take_path
from studio.take.video.kept import FOLDER as VIDEOS
from studio.take.video.kept import has_video

FOLDER = ".trash"


@dataclass(frozen=True)
class Thrown:
    """A take in the trash: its id there, its former session and name, the time of removal (ISO 8601, UTC).

    `solve` names the removed solve of the take; `video`: it is the take's videos. Neither: the whole take.
    """

    id: str
    session: str
    name: str
    thrown: str
    solve: str = ""
    video: bool = False


def throw_away(sessions_dir: Path, session: str, name: str) -> Thrown:
    """Move a take to the trash.

    Raises:
        TakeError: no such take, a name that is not allowed, a take in use, or a folder that cannot be moved.
    """
    path = take_path(sessions_dir, session, name)
    if not (path / "take.json").is_file():
        raise TakeError("trash.no_take", "there is no take {take} to throw away", take=f"{session}/{name}")
    if is_held(path):
        raise TakeError(
            "take.in_use", "take {take} is in use; wait until that is done", take=f"{session}/{name}"
        )
    return _move_to_trash(sessions_dir, Thrown(secrets.token_hex(6), session, name, utc_now()), path)


def throw_solve_away(sessions_dir: Path, session: str, name: str, solve: str) -> Thrown:
    """Move one solve of a take to the trash.

    Raises:
        TakeError: no such take or solve, a name that is not allowed, or a folder that cannot be moved.
    """
    take = Take.open(take_path(sessions_dir, session, name))
    if solve not in take.solve_names():
        raise TakeError(
            "trash.no_solve",
            "take {take} has no solve {solve!r} to throw away",
            take=f"{session}/{name}",
            solve=solve[:80],
        )
    thrown = Thrown(secrets.token_hex(6), session, name, utc_now(), check_name("solve", solve))
    return _move_to_trash(sessions_dir, thrown, take.solve_folder(solve))


def throw_video_away(sessions_dir: Path, session: str, name: str) -> Thrown:
    """Move the videos of a take to the trash; those that cameras still owe are no longer wanted.

    Raises:
        TakeError: no such take, one without videos, a name that is not allowed, or a folder that cannot be moved.
    """
    take = Take.open(take_path(sessions_dir, session, name))
    if not has_video(take.path):
        raise TakeError(
            "trash.no_video", "take {take} keeps no video to throw away", take=f"{session}/{name}"
        )
    take.meta["video_unwanted"] = True
    take.save_meta()
    thrown = Thrown(secrets.token_hex(6), session, name, utc_now(), video=True)
    return _move_to_trash(sessions_dir, thrown, take.path / VIDEOS)


def _move_to_trash(sessions_dir: Path, thrown: Thrown, path: Path) -> Thrown:
    place = sessions_dir / FOLDER / thrown.id
    value = {key: what for key, what in vars(thrown).items() if key != "id"}
    try:
        place.mkdir(parents=True)
        write_json(place / "thrown.json", value)
        path.rename(place / _what(thrown))
    except OSError as error:
        shutil.rmtree(place, ignore_errors=True)
        raise TakeError(
            "trash.not_moved",
            "cannot move {name} to the trash: {error}",
            name=path.name,
            error=system_says(error),
        ) from error
    return thrown


def _what(thrown: Thrown) -> str:
    return "solve" if thrown.solve else "video" if thrown.video else "take"


def list_trash(sessions_dir: Path) -> list[Thrown]:
    """Return the content of the trash, the newest first."""
    found = []
    for file in (sessions_dir / FOLDER).glob("*/thrown.json"):
        try:
            value = json.loads(file.read_text(encoding="utf-8"))
            session, name, thrown = (str(value[key]) for key in ("session", "name", "thrown"))
            found.append(
                Thrown(
                    file.parent.name,
                    session,
                    name,
                    thrown,
                    str(value.get("solve", "")),
                    value.get("video") is True,
                )
            )
        except (OSError, ValueError, KeyError, TypeError):
            continue  # not made by the studio
    return sorted(found, key=lambda thrown: (thrown.thrown, thrown.id), reverse=True)


def restore(sessions_dir: Path, trash_id: str) -> tuple[str, str]:
    """Restore a take, a solve or videos, under another name if its own is taken; return the take's session and name.

    Raises:
        TakeError: nothing of that id in the trash, a part of a take that is gone, or a folder that cannot be moved.
    """
    thrown = _find(sessions_dir, trash_id)
    if thrown.solve:
        return _restore_solve(sessions_dir, thrown)
    if thrown.video:
        return _restore_video(sessions_dir, thrown)
    name, number = thrown.name, 2
    while take_path(sessions_dir, thrown.session, name).exists():
        name, number = f"{thrown.name[:55]}_{number}", number + 1
    path = take_path(sessions_dir, thrown.session, name)
    check_free(path)
    place = sessions_dir / FOLDER / thrown.id
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        (place / "take").rename(path)
    except OSError as error:
        raise TakeError(
            "trash.take_not_restored",
            "cannot restore {name}: {error}",
            name=f"{thrown.session}/{name}",
            error=system_says(error),
        ) from error
    shutil.rmtree(place, ignore_errors=True)
    return thrown.session, name


def _restore_solve(sessions_dir: Path, thrown: Thrown) -> tuple[str, str]:
    path = take_path(sessions_dir, thrown.session, thrown.name)
    if not (path / "take.json").is_file():
        raise TakeError(
            "trash.take_gone",
            "the take {take} of solve {solve!r} is not there; restore it first",
            take=f"{thrown.session}/{thrown.name}",
            solve=thrown.solve,
        )
    take, name, number = Take.open(path), thrown.solve, 2
    while take.solve_folder(name).exists():
        name, number = f"{thrown.solve[:55]}_{number}", number + 1
    place = sessions_dir / FOLDER / thrown.id
    try:
        take.solve_folder(name).parent.mkdir(exist_ok=True)
        (place / "solve").rename(take.solve_folder(name))
    except OSError as error:
        raise TakeError(
            "trash.solve_not_restored",
            "cannot restore solve {name!r}: {error}",
            name=name,
            error=system_says(error),
        ) from error
    shutil.rmtree(place, ignore_errors=True)
    return thrown.session, thrown.name


def _restore_video(sessions_dir: Path, thrown: Thrown) -> tuple[str, str]:
    path = take_path(sessions_dir, thrown.session, thrown.name)
    if not (path / "take.json").is_file() or has_video(path):
        raise TakeError(
            "trash.video_has_no_place",
            "the take {take} of the video is not there, or has a video; restore the take, or move its video away, "
            "first",
            take=f"{thrown.session}/{thrown.name}",
        )
    take, place = Take.open(path), sessions_dir / FOLDER / thrown.id
    try:
        shutil.rmtree(path / VIDEOS, ignore_errors=True)  # without any video
        (place / "video").rename(path / VIDEOS)
    except OSError as error:
        raise TakeError(
            "trash.video_not_restored",
            "cannot restore the video of {take}: {error}",
            take=f"{thrown.session}/{thrown.name}",
            error=system_says(error),
        ) from error
    take.meta.pop("video_unwanted", None)
    take.save_meta()
    shutil.rmtree(place, ignore_errors=True)
    return thrown.session, thrown.name


def empty_trash(sessions_dir: Path, trash_id: str | None = None) -> int:
    """Delete one take of the trash for good, or all; return their number.

    Raises:
        TakeError: nothing of that id in the trash.
    """
    gone = list_trash(sessions_dir) if trash_id is None else [_find(sessions_dir, trash_id)]
    for thrown in gone:
        shutil.rmtree(sessions_dir / FOLDER / thrown.id, ignore_errors=True)
    return len(gone)


def _find(sessions_dir: Path, trash_id: str) -> Thrown:
    if is_safe_name(trash_id):
        inside(sessions_dir / FOLDER, trash_id)
        for thrown in list_trash(sessions_dir):
            if thrown.id == trash_id:
                return thrown
    raise TakeError("trash.none", "there is nothing with the id {id!r} in the trash", id=trash_id[:40])
