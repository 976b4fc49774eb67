"""Records the pictures of an ordinary camera during takes: H.264 in fragmented MP4, in parts of ten seconds.

Encoding runs in its own thread with a short queue: if this machine is too slow, the video omits pictures, and the
landmarks continue. Each picture keeps its capture time on the source's clock.
"""

import logging
import queue
import threading
from fractions import Fraction
from typing import IO, TYPE_CHECKING

import numpy as np

from studio import wire
from studio.camera.client.video_spool import SpooledPart, VideoOrigin, VideoSpool
from studio.engine.base.sentences import say, system_says
from studio.engine.base.system import lower_thread_priority

if TYPE_CHECKING:
    import av
    from av.container import OutputContainer
    from av.video.stream import VideoStream

PART_NS = 10_000_000_000
LONGEST_SIDE = 1920
"""Maximum side of a picture [pixels]; larger pictures are reduced."""

_WAITING = 6
_NICENESS = 10
_KEY_NS = 1_000_000_000
_UNIT = Fraction(1, 90_000)
_OPTIONS = {"preset": "superfast", "crf": "24", "bf": "0", "tune": "zerolatency", "threads": "1"}
_CONTAINER = {"movflags": "frag_keyframe+empty_moov+default_base_moof", "flush_packets": "1"}

log = logging.getLogger(__name__)


class VideoRecorder:
    """Records the video of one start of a client; `picture` may be called from any thread, the rest from one.

    Args:
        spool: where the parts go.
        mirrored: the camera swaps left and right; the video swaps them back, as the landmarks do.

    Attributes:
        spool: as given.
        left_out: number of pictures that were left out because this machine was too slow.
        problem: why nothing is recorded, for people; "" = no problem.
    """

    def __init__(self, spool: VideoSpool, *, mirrored: bool = False) -> None:
        self.spool, self._mirrored = spool, mirrored
        self._queue: queue.Queue[tuple[int, av.VideoFrame] | None] = queue.Queue(_WAITING)
        self._origin: VideoOrigin | None = None
        self._thread: threading.Thread | None = None
        self.left_out = 0
        self.problem = ""

    @property
    def recording(self) -> bool:
        return self._origin is not None

    def recording_changed(self, message: wire.Recording, name: str, boot_id: str, next_sequence: int) -> None:
        """Begin or end, as the server says."""
        wanted = message.take_id if message.active else ""
        if self._origin is not None and self._origin.take_id != wanted:
            self.stop()
        if wanted and self._origin is None:
            self._origin = VideoOrigin(wanted, name, boot_id, next_sequence)
            self._thread = threading.Thread(target=self._run, args=(self._origin,), name="video", daemon=True)
            self._thread.start()

    def picture(self, time_ns: int, frame: "av.VideoFrame") -> None:
        """Queue a picture with its capture time on the source's clock [ns]; does not wait."""
        if self._origin is None:
            return
        try:
            self._queue.put_nowait((time_ns, frame))
        except queue.Full:
            self.left_out += 1

    def stop(self) -> None:
        """End the recording; the last part is complete afterwards."""
        self._origin, thread, self._thread = None, self._thread, None
        if thread is not None:
            self._queue.put(None)
            thread.join()

    # --- the thread

    def _run(self, origin: VideoOrigin) -> None:
        part: _PartWriter | None = None
        self.problem = ""
        lower_thread_priority(_NICENESS)  # landmarks take precedence
        while (item := self._queue.get()) is not None:
            if self.problem:
                continue
            try:
                if part is not None and item[0] - part.first_ns >= PART_NS:
                    part.close()
                    part = None
                if part is None:
                    if self.spool.full:
                        self.problem = say(
                            "camera.video_spool_full",
                            "the video is not recorded: its spool is full; let the studio fetch it first",
                        )
                        continue
                    part = _PartWriter(self.spool.begin(origin), item[0], self._mirrored)
                part.write(*item)
            except OSError as error:  # also FFmpeg's
                self.problem = say(
                    "camera.video_unwritable", "the video is not recorded: {error}", error=system_says(error)
                )
                log.warning("%s", self.problem)
        if part is not None:
            part.close()


class _PartWriter:
    """Writes one part; opened with its first picture, whose size it keeps."""

    def __init__(self, part: SpooledPart, first_ns: int, mirrored: bool) -> None:
        from av.video.reformatter import VideoReformatter

        self.first_ns = first_ns
        self._part, self._mirrored = part, mirrored
        self._container: OutputContainer | None = None
        self._stream: VideoStream | None = None
        self._times: IO[bytes] = part.times_path.open("ab", buffering=0)
        self._last_ns = self._key_ns = -1
        self._reformatter = VideoReformatter()  # its own: the frame's is used for the landmarks meanwhile

    def write(self, time_ns: int, frame: "av.VideoFrame") -> None:
        import av

        if time_ns <= self._last_ns:
            return
        upright = self._upright(frame)
        if self._container is None or self._stream is None:
            self._container = av.open(str(self._part.path), "w", format="mp4", options=_CONTAINER)
            self._stream = self._container.add_stream("libx264", rate=30, options=_OPTIONS)
            by = min(1.0, LONGEST_SIDE / max(upright.width, upright.height))
            self._stream.width, self._stream.height = (
                max(2, round(side * by) // 2 * 2) for side in (upright.width, upright.height)
            )
            self._stream.pix_fmt, self._stream.time_base = "yuv420p", _UNIT
            self._stream.codec_context.time_base = _UNIT
        made = self._reformatter.reformat(upright, self._stream.width, self._stream.height, "yuv420p")
        made.pts, made.time_base = round((time_ns - self.first_ns) * 1e-9 / _UNIT), _UNIT
        made.pict_type = 0
        if self._key_ns < 0 or time_ns - self._key_ns >= _KEY_NS:
            made.pict_type, self._key_ns = 1, time_ns
        self._container.mux(self._stream.encode(made))
        self._times.write(np.int64(time_ns).astype("<i8").tobytes())
        self._last_ns = time_ns

    def close(self) -> None:
        try:
            if self._container is not None and self._stream is not None:
                self._container.mux(self._stream.encode())
                self._container.close()
        finally:
            self._times.close()

    def _upright(self, frame: "av.VideoFrame") -> "av.VideoFrame":
        import av

        quarters = round(frame.rotation / 90) % 4
        if not quarters and not self._mirrored:
            return frame
        image = np.rot90(self._reformatter.reformat(frame, format="rgb24").to_ndarray(), quarters)
        image = image[:, ::-1] if self._mirrored else image
        return av.VideoFrame.from_ndarray(np.ascontiguousarray(image, dtype=np.uint8), format="rgb24")
