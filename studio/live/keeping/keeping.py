"""Frames that clients keep until they are on the disk: clients learn which are, and late frames are recorded."""

from collections.abc import Callable

from studio.engine.base.errors import FormatError
from studio.live.cameras.links import CameraLink, Links
from studio.live.engine import Engine
from studio.live.inbox import Arrived
from studio.live.keeping.late import LateTakes
from studio.live.recording.recorder import Recorder
from studio.take.raw.frames import camera_frame
from studio.take.raw.membership import STRANGER, Key
from studio.wire import ENDED, Ack, Kept, Late, SkeletonFrame, check_hello, decode

MAX_STARTS = 1000
"""Most earlier starts of one client whose frames are accepted on one connection."""


class Keeping:
    """Answers the messages `kept` and `late`; methods may be called from any thread."""

    def __init__(self, links: Links, engine: Engine, late: LateTakes, clock_ns: Callable[[], int]) -> None:
        self._links = links
        self._engine = engine
        self._late = late
        self._clock_ns = clock_ns

    def kept(self, link: CameraLink, message: Kept) -> None:
        """Handle a client's message that it keeps frames of a take. The client is told which are on the disk, now
        and whenever there are more.

        Raises:
            FormatError: frames of another camera.
            CameraRefused: see `CameraLink`.
        """
        self._links.check(link, self._clock_ns())
        if message.hello is not None:
            if message.hello.name != link.name or message.hello.boot_id != message.boot_id:
                raise FormatError(
                    "kept.of_another",
                    "kept frames must be of the camera's own name and of the start that they name",
                )
            check_hello(message.hello)
            link.hellos = {**dict(list(link.hellos.items())[-MAX_STARTS:]), message.boot_id: message.hello}
        hello = link.hello_of(message.boot_id)
        if hello is None:
            raise FormatError(
                "kept.no_hello", "frames of an earlier start are kept, but its hello is not told"
            )
        recording = self._engine.recording
        if recording is not None and recording.recorder.take_id == message.take_id:
            key = (link.name, message.boot_id)
            if not recording.recorder.owed.joined(key):
                count = max(0, message.last - message.first + 1)
                recording.recorder.owed.refused(link.name, STRANGER, count)
                link.send(Ack(message.take_id, message.boot_id, ENDED))
                return
            link.kept[message.take_id, message.boot_id] = message.first
            recording.recorder.owed.keeps(key, message.first, message.last)
            link.send(recording.recorder.owed.ack(key, message.first))
            if self._engine.recording is recording:
                return
        self._late.kept(message.take_id, hello, message.first, message.last, link.send)

    def late(self, link: CameraLink, message: Late, arrival_ns: int) -> None:
        """Handle a kept frame that the client sends again.

        Raises:
            FormatError: not a frame of the camera's.
            CameraRefused: see `CameraLink`.
        """
        self._links.check(link, arrival_ns)
        hello = link.hello_of(message.boot_id)
        inner = decode(message.data)
        if hello is None or not isinstance(inner, SkeletonFrame):
            raise FormatError(
                "kept.not_a_skeleton",
                "a late message must hold a skeleton of a start of the client that it has told of",
            )
        frame = camera_frame(link.name, hello.joint_set, inner)
        recording = self._engine.recording
        if recording is not None and recording.recorder.take_id == message.take_id:
            self._engine.put(Arrived(frame, message.data, arrival_ns, hello, message.take_id))
        else:
            self._late.frame(message.take_id, hello, frame, message.data, arrival_ns, link.send)

    def synced(self, recorder: Recorder, keys: set[Key], *, ended: bool = False) -> None:
        """Tell the clients that keep a take's frames that more is on the disk; `ended`: nothing more comes."""
        for link in self._links.all():
            for (take_id, boot_id), first in list(link.kept.items()):
                if take_id != recorder.take_id:
                    continue
                key = (link.name, boot_id)
                if ended or key in keys:
                    link.send(recorder.owed.ack(key, first, ended=ended))
                if ended:
                    link.kept.pop((take_id, boot_id), None)
