"""Recordings on the server's machine that can be played as cameras: takes, and those in allowed folders.

A recording is named `<place>/<path inside it>`; no name or link leads outside the places.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from studio.api.errors import NotFoundError
from studio.engine.base.errors import SettingsError, StudioError
from studio.take.importers import IMPORTERS, videos
from studio.take.importers.keypoints import reading as keypoints
from studio.take.library.sessions import take_ids, take_info

TAKES = "takes"
FOLDER = "recordings"
DEPTH = 3
"""Number of folder levels that are searched below a place."""

MOST = 300
"""Maximum number of recordings in the list."""

MOST_LOOKED_AT = 5000
_MARKS = "#?"
"""Characters with a meaning in a source's text."""


@dataclass(frozen=True)
class FoundRecording:
    """A recording: its id, its folder or file, and its cameras; without names if only playing it shows them."""

    id: str
    path: Path
    cameras: tuple[str, ...]

    def sources(self) -> dict[str, str]:
        """Return arguments of `studio camera --source`, by camera."""
        if videos.matches(self.path) and not (self.path / "take.json").is_file():
            return {name: f"video:{file}" for name, file in videos.video_files(self.path).items()}
        if not self.cameras:
            return {_plain_name(self.path.stem): f"recording:{self.path}"}
        return {name: f"recording:{self.path}#{name}" for name in self.cameras}


class Recordings:
    """Finds recordings in the sessions and in one more folder."""

    def __init__(self, sessions: Path, folder: Path | None = None) -> None:
        self._places = {TAKES: sessions.resolve()}
        if folder is not None:
            self._places[FOLDER] = folder.resolve()

    def list(self) -> "list[FoundRecording]":
        """Return all playable recordings, takes first."""
        found: list[FoundRecording] = []
        for place in self._places:
            for path, cameras in self._playable(place):
                found.append(FoundRecording(f"{place}/{self._within(place, path)}", path, cameras))
                if len(found) == MOST:
                    return found
        return found

    def find(self, id_: str) -> FoundRecording:
        """Return a recording by its id.

        Raises:
            NotFoundError: there is none, or it lies outside the places.
            SettingsError: it cannot be played.
        """
        place, _, rest = id_.partition("/")
        root = self._places.get(place)
        path = None if root is None or "\0" in rest else (root / rest).resolve()
        if root is None or path is None or not path.is_relative_to(root) or path == root or not path.exists():
            raise NotFoundError(
                "recording.none", "there is no recording {id!r}; GET /api/v1/recordings lists them", id=id_
            )
        cameras = self._cameras(path)
        if cameras is None:
            raise SettingsError(
                "recording.unplayable",
                "{id} is no recording that can be played; GET /api/v1/recordings lists them",
                id=id_,
            )
        return FoundRecording(id_, path, cameras)

    def _within(self, place: str, path: Path) -> str:
        return path.relative_to(self._places[place]).as_posix()

    def _playable(self, place: str) -> Iterator[tuple[Path, tuple[str, ...]]]:
        """Recordings of a place with their cameras, without files inside a take or a recording."""
        if place == TAKES:
            for id_ in take_ids(self._places[TAKES]):
                path = self._places[TAKES] / id_
                cameras = self._cameras(path) if (path / "take.json").is_file() else None
                if cameras is not None:
                    yield path, cameras
            return
        looked_at = 0
        waiting = [(self._places[place], 0)]
        while waiting:
            folder, depth = waiting.pop(0)
            try:
                entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
            except OSError:
                continue
            for entry in entries:
                looked_at += 1
                if looked_at > MOST_LOOKED_AT:
                    return
                if entry.name.startswith(".") or entry.is_symlink():
                    continue
                path = Path(entry.path)
                cameras = self._cameras(path)
                if cameras is not None:
                    yield path, cameras
                elif entry.is_dir() and depth + 1 < DEPTH:
                    waiting.append((path, depth + 1))

    def _cameras(self, path: Path) -> tuple[str, ...] | None:
        """Names of a recording's cameras, none if known only by playing it; None if it cannot be played."""
        if any(mark in str(path) for mark in _MARKS):
            return None
        try:
            if (path / "take.json").is_file():
                return _cameras_of_take(path)
            kind = next((name for name, one in IMPORTERS.items() if one.matches(path)), None)
            if kind is None:
                return None
            if kind == "videos":
                return tuple(videos.video_files(path))
            if kind == "keypoint-folders":
                return tuple(keypoints.camera_sources(path))
            return _cameras_of_folder(path) if path.is_dir() else ()
        except (OSError, StudioError, ValueError):
            return None


def _cameras_of_take(path: Path) -> tuple[str, ...] | None:
    """Names of the cameras of a take with frames; None without frames."""
    names = take_info(path).cameras
    playable = (path / "raw.mcap").is_file() and not any(mark in name for name in names for mark in _MARKS)
    return names if playable and names else None


def _cameras_of_folder(path: Path) -> tuple[str, ...]:
    return tuple(sorted(one.name for one in path.glob("camera_*") if one.is_dir()))


def _plain_name(text: str) -> str:
    """A camera name made from a file name."""
    name = "".join(sign if sign.isascii() and (sign.isalnum() or sign in "_-") else "_" for sign in text)
    return name[:40] or "camera_0"
