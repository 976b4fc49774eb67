"""Videos that camera clients recorded during takes, fetched after the takes have ended.

A client describes a part, then sends its bytes in pieces; after a cut link it continues where the server is. A part
goes into the take only if the start of the client (name and boot id) joined the recording, as for late frames, and
the part was taken during it. The server names the file. Until a part is whole and was read as a video, it lies in
`sessions/.video`.
"""

import hashlib
import logging
import shutil
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.files import FileStamp, file_stamp
from studio.take.folder.take import Take
from studio.take.library.sessions import find_take
from studio.take.raw.append import scan_raw
from studio.take.raw.membership import Membership
from studio.take.video.kept import KEPT_FREE_BYTES, keep_video, kept_videos
from studio.worker import run_in_process

_log = logging.getLogger(__name__)

FOLDER = ".video"
MAX_PART_BYTES = 512 << 20
MAX_PART_FRAMES = 30_000
LEFT_S = 30 * 86_400.0
"""Age after which pieces of unfinished parts are deleted [s]."""

_MOST_OPEN = 500

State = Literal["wanted", "kept", "unwanted", "unknown", "later"]
"""`wanted`: send on; `kept`: it is in the take; `unwanted`: the take will never have it; `unknown`: there is no such
take; `later`: the take is being recorded, or the disk is full."""


@dataclass(frozen=True)
class VideoPart:
    """A part of a camera's video, as its client describes it.

    Attributes:
        take_id: of the take, as in `wire.Recording`.
        name, boot_id: of the client's start that recorded it.
        from_sequence: see `KeptVideo`.
        size: of the file [bytes].
        sha256: of the file, hexadecimal.
        ending: of the file, such as `.mp4`.
        times_ns: capture time of each frame on the client's clock [ns], increasing.
    """

    take_id: str
    name: str
    boot_id: str
    from_sequence: int
    size: int
    sha256: str
    ending: str
    times_ns: tuple[int, ...]

    @property
    def id(self) -> str:
        """Identifier of the part, which names the file of its received pieces."""
        text = repr((self.take_id, self.name, self.boot_id, self.times_ns[:1], self.sha256))
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


@dataclass(frozen=True)
class PartState:
    """What the server has of a part: how many bytes, and what it wants."""

    id: str
    state: State
    received: int = 0
    reason: str = ""


@dataclass
class _Open:
    part: VideoPart
    take: Path
    lock: threading.Lock = field(default_factory=threading.Lock)


class LateVideos:
    """Receives parts of videos; methods may be called from any thread."""

    def __init__(self, sessions: Path) -> None:
        self._sessions, self._folder = sessions, sessions / FOLDER
        self._open: dict[str, _Open] = {}
        self._lock = threading.Lock()
        self._members: tuple[tuple[Path, FileStamp], Membership] | None = None
        for file in self._folder.glob("*"):
            if file.is_file() and file.stat().st_mtime < time.time() - LEFT_S:
                file.unlink(missing_ok=True)

    def begin(self, part: VideoPart) -> PartState:
        """Return whether a part is wanted, and how much of it is there."""
        path = find_take(self._sessions, part.take_id)
        if path is None:
            return PartState(part.id, "unknown")
        take = Take.open(path)
        if take.meta["recording"] == "recording":
            return PartState(part.id, "later", reason="the take is being recorded")
        state, reason = self._wanted(take, part)
        if state != "wanted":
            return PartState(part.id, state, reason=reason)
        self._folder.mkdir(parents=True, exist_ok=True)
        received = self._received(part.id)
        if not self._fits(part.size - received):
            return PartState(part.id, "later", received, "the disk of the studio is full")
        with self._lock:
            self._open.setdefault(part.id, _Open(part, path))
            while len(self._open) > _MOST_OPEN:
                self._open.pop(next(iter(self._open)))
        return PartState(part.id, "wanted", received)

    def write(self, id_: str, at: int, data: bytes) -> PartState:
        """Add a piece of a part, which begins at byte `at`; one that does not continue the part is ignored. The last
        piece makes the part a video of the take.

        Raises:
            FormatError: more bytes than were described.
        """
        with self._lock:
            opened = self._open.get(id_)
        if opened is None:
            return PartState(id_, "unknown")
        with opened.lock:
            received = self._received(id_)
            if at != received:
                return PartState(id_, "wanted", received)
            if received + len(data) > opened.part.size:
                self._forget(id_)
                raise FormatError(
                    "video.part_too_long", "the part of the video is longer than it was said to be"
                )
            if not self._fits(len(data)):
                return PartState(id_, "later", received, "the disk of the studio is full")
            with self._place(id_).open("ab") as file:
                file.write(data)
            if received + len(data) < opened.part.size:
                return PartState(id_, "wanted", received + len(data))
            return self._end(opened)

    def _end(self, opened: _Open) -> PartState:
        """Put a whole part into its take."""
        part, file = opened.part, self._place(opened.part.id)
        with file.open("rb") as whole:
            digest = hashlib.file_digest(whole, "sha256").hexdigest()
        if digest != part.sha256:
            self._forget(part.id)
            return PartState(part.id, "later", 0, "the part came damaged")
        named = file.with_suffix(part.ending)
        try:
            file.rename(named)
            frames = run_in_process("studio.take.video.check:frame_times_ns", named, spare=False)
            take = Take.open(opened.take)
            state, reason = self._wanted(take, part)  # it may have arrived otherwise meanwhile
            if state != "wanted":
                return PartState(part.id, state, reason=reason)
            count = min(len(frames), len(part.times_ns))
            keep_video(
                take, named, camera=part.name, boot_id=part.boot_id, at_ns=frames[:count],
                times_ns=np.array(part.times_ns[:count], np.int64), from_sequence=part.from_sequence, moved=True,
            )  # fmt: skip
        except FormatError as error:
            _log.warning("a video of %s for %s is not kept: %s", part.name, opened.take, error)
            return PartState(part.id, "unwanted", reason=str(error))
        except StudioError as error:
            _log.warning("a video of %s for %s is not kept yet: %s", part.name, opened.take, error)
            return PartState(part.id, "later", reason=str(error))
        finally:
            named.unlink(missing_ok=True)
            self._forget(part.id)
        _log.info("%d frames of video of %s were added to %s", count, part.name, opened.take)
        return PartState(part.id, "kept", part.size)

    def _wanted(self, take: Take, part: VideoPart) -> tuple[State, str]:
        """Return whether a take that has ended wants a part, and why not."""
        if take.meta.get("video_unwanted"):
            return "unwanted", "the video of this take was deleted"
        first_ns, last_ns = part.times_ns[0], part.times_ns[-1]
        for video in kept_videos(take.path).get(part.name, ()):
            if video.boot_id == part.boot_id and video.times_ns[0] <= first_ns <= video.times_ns[-1]:
                return "kept", ""
        reason = self._membership(take).refusal_of_span(
            (part.name, part.boot_id), part.from_sequence, first_ns, last_ns
        )
        return ("unwanted", reason) if reason else ("wanted", "")

    def _membership(self, take: Take) -> Membership:
        key = take.raw_path, file_stamp(take.raw_path)
        with self._lock:
            if self._members is None or self._members[0] != key:
                self._members = key, Membership(scan_raw(take.raw_path))
            return self._members[1]

    def _place(self, id_: str) -> Path:
        return self._folder / f"{id_}.part"

    def _received(self, id_: str) -> int:
        place = self._place(id_)
        return place.stat().st_size if place.is_file() else 0

    def _fits(self, more: int) -> bool:
        return shutil.disk_usage(self._sessions).free - more > KEPT_FREE_BYTES

    def _forget(self, id_: str) -> None:
        self._place(id_).unlink(missing_ok=True)
        with self._lock:
            self._open.pop(id_, None)
