"""Videos that a client recorded during takes, in a folder on its own disk until the server has them.

A part is `<number>.mp4` with `<number>.json` (its origin) and `<number>.times` (capture time of each frame, int64,
little endian). They grow together: after a client was killed, the frames that are complete in all of them remain.
"""

import contextlib
import time
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from studio.engine.base.errors import SettingsError
from studio.engine.base.sentences import system_says

MAX_BYTES = 8 << 30
"""Largest size: at 1080p about three hours."""


class VideoOrigin(msgspec.Struct, frozen=True):
    """Origin of a part: take, and start of the client that recorded it; see `live.keeping.video.VideoPart`."""

    take_id: str
    name: str
    boot_id: str
    from_sequence: int


@dataclass(frozen=True)
class SpooledPart:
    """A part that was recorded."""

    path: Path
    origin: VideoOrigin

    @property
    def times_path(self) -> Path:
        return self.path.with_suffix(".times")

    def times_ns(self) -> list[int]:
        """Return the capture times of its frames [ns]; none if they are lost."""
        try:
            data = self.times_path.read_bytes()
        except OSError:
            return []
        return np.frombuffer(data[: len(data) // 8 * 8], "<i8").tolist()

    @property
    def age_s(self) -> float:
        """Time since it was recorded [s]."""
        return max(0.0, time.time() - self.path.stat().st_mtime)

    def delete(self) -> None:
        for path in (self.path, self.times_path, self.path.with_suffix(".json")):
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)


class VideoSpool:
    """Parts of videos on disk.

    Args:
        folder: made if missing; the client's alone.
        max_bytes: largest size.

    Raises:
        SettingsError: the folder cannot be used.
    """

    def __init__(self, folder: Path, *, max_bytes: int = MAX_BYTES) -> None:
        self._folder, self._max_bytes = folder, max_bytes
        try:
            folder.mkdir(parents=True, exist_ok=True)
            numbers = [int(file.stem) for file in folder.iterdir() if file.stem.isdigit()]
        except OSError as error:
            raise SettingsError(
                "spool.unusable",
                "spool {folder} cannot be used: {error}; choose another --spool",
                folder=folder,
                error=system_says(error),
            ) from error
        self._number = max(numbers, default=0)

    @property
    def full(self) -> bool:
        """Whether no further part may begin."""
        return self.size_bytes >= self._max_bytes

    @property
    def size_bytes(self) -> int:
        sizes = 0
        for file in self._folder.iterdir():
            with contextlib.suppress(OSError):
                sizes += file.stat().st_size
        return sizes

    def begin(self, origin: VideoOrigin) -> SpooledPart:
        """Return a new part, with its description on the disk.

        Raises:
            OSError: the disk is full, or cannot be written.
        """
        self._number += 1
        path = self._folder / f"{self._number}.mp4"
        path.with_suffix(".json").write_bytes(msgspec.json.encode(origin))
        return SpooledPart(path, origin)

    def parts(self) -> list[SpooledPart]:
        """Return the parts, the oldest first; those without a description or a frame are deleted."""
        found = []
        for file in sorted(self._folder.glob("*.json"), key=lambda one: (len(one.stem), one.stem)):
            try:
                origin = msgspec.json.decode(file.read_bytes(), type=VideoOrigin)
            except (OSError, msgspec.DecodeError):
                file.unlink(missing_ok=True)
                continue
            found.append(SpooledPart(file.with_suffix(".mp4"), origin))
        return found

    def close(self) -> None:
        """Remove the folder if nothing is left in it."""
        with contextlib.suppress(OSError):
            self._folder.rmdir()
