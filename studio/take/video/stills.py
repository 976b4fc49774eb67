"""Single pictures of video files as JPEG, decoded in a separate process.

Files come from anywhere: one that breaks the decoder ends that process, not the server. A file stays open at the last
picture, so that the next ones need no search.
"""

import io
import multiprocessing
import signal
import threading
from collections import OrderedDict
from collections.abc import Iterator
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import TYPE_CHECKING

from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.system import lower_priority
from studio.take.video.file import VideoFile
from studio.worker.parent import end_with_parent

if TYPE_CHECKING:
    import av

OPEN_FILES = 6
PATIENCE_S = 30.0
"""Timeout of a picture [s]."""

_QUALITY = 82
_NICENESS = 5
_ON_S = 2.0
"""Maximum distance of the next picture in the file without a search from the keyframe before it [s]."""


class Stills:
    """Reads pictures of videos, in a process that starts with the first one; usable from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: BaseProcess | None = None
        self._here: Connection | None = None

    def picture(self, path: Path, at_ns: int, width: int) -> bytes:
        """Return the picture at a time of a video as JPEG, upright.

        Args:
            path: of the video.
            at_ns: as `VideoFile.frames` gives it [ns].
            width: maximum width of the picture [pixels]; smaller ones are unchanged.

        Raises:
            FormatError: the file is no video, or has no picture there that can be read.
            StudioError: the decoder broke, or took too long.
        """
        with self._lock:
            here = self._connected()
            try:
                here.send((path, at_ns, width))
                if not here.poll(PATIENCE_S):
                    raise EOFError
                answer = here.recv()
            except (EOFError, OSError) as error:
                self._end()
                raise StudioError(
                    "video.decoder_broke",
                    "the decoder broke at {name}; is the file whole?",
                    name=path.name,
                ) from error
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self) -> None:
        """End the process."""
        with self._lock:
            self._end()

    def _connected(self) -> Connection:
        if self._here is None or self._process is None or not self._process.is_alive():
            self._end()
            context = multiprocessing.get_context("spawn")
            self._here, there = context.Pipe()
            self._process = context.Process(target=_work, args=(there,), name="pictures", daemon=True)
            self._process.start()
            there.close()
        return self._here

    def _end(self) -> None:
        if self._here is not None:
            self._here.close()
        if self._process is not None:
            self._process.kill()
            self._process.join()
        self._here = self._process = None


class _OpenVideo:
    """A video that is being read: the frames from the last picture on."""

    def __init__(self, path: Path) -> None:
        self._video = VideoFile.open(path)
        self._frames: Iterator[tuple[int, av.VideoFrame]] | None = None
        self._last: tuple[int, av.VideoFrame] | None = None

    def frame(self, at_ns: int) -> "av.VideoFrame":
        """Return the frame at a time."""
        on_ns = -1 if self._last is None else at_ns - self._last[0]
        if self._last is not None and on_ns == 0:
            return self._last[1]
        if self._frames is None or not 0 < on_ns < _ON_S * 1e9:
            self._search(at_ns)
        while self._last is None or self._last[0] < at_ns:
            self._next()
            if self._last is None:
                break
        if self._last is not None and self._last[0] == at_ns:
            return self._last[1]
        raise FormatError(
            "video.no_picture",
            "{name} has no picture at {s:.3f} s",
            name=self._video.path.name,
            s=at_ns * 1e-9,
        )

    def _search(self, at_ns: int) -> None:
        """Begin at a keyframe before a time, or at it; the accuracy of these times varies with the file."""
        for earlier_s in (0.0, 2.0, 20.0, float("inf")):
            from_ns = 0 if earlier_s * 1e9 > at_ns else at_ns - round(earlier_s * 1e9)
            self._frames = self._video.frames(from_ns=from_ns)
            self._next()
            if (self._last is not None and self._last[0] <= at_ns) or from_ns == 0:
                return

    def _next(self) -> None:
        self._last = next(self._frames, None) if self._frames is not None else None


def _work(connection: Connection) -> None:
    """Answer requests until the studio has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None and parent.pid is not None:
        end_with_parent(parent.pid)
    lower_priority(_NICENESS)
    videos: OrderedDict[tuple[Path, int], _OpenVideo] = OrderedDict()
    while True:
        try:
            path, at_ns, width = connection.recv()
        except (EOFError, OSError):
            return
        try:
            key = path, path.stat().st_mtime_ns
            videos.setdefault(key, _OpenVideo(path)) if key not in videos else videos.move_to_end(key)
            while len(videos) > OPEN_FILES:
                videos.popitem(last=False)
            answer: bytes | Exception = jpeg(videos[key].frame(at_ns), width)
        except StudioError as error:
            answer = error
        except OSError:
            answer = FormatError("video.none", "no video at {path}: there is no such file", path=path)
        connection.send(answer)


def jpeg(frame: "av.VideoFrame", width: int) -> bytes:
    """Return a frame as JPEG, upright and at most `width` wide [pixels]."""
    import numpy as np
    from PIL import Image

    quarters = round(frame.rotation / 90) % 4
    across = frame.height if quarters % 2 else frame.width
    by = min(1.0, width / across)
    columns, rows = max(1, round(frame.width * by)), max(1, round(frame.height * by))
    image = frame.to_ndarray(format="rgb24", width=columns, height=rows, interpolation="BILINEAR")
    out = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(np.rot90(image, quarters))).save(out, "JPEG", quality=_QUALITY)
    return out.getvalue()
