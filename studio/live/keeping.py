"""Frames that clients keep until they are on the disk: what is there is told, what comes late is taken in."""

from collections.abc import Callable

from studio.engine.errors import FormatError
from studio.live.engine import Engine
from studio.live.inbox import Arrived
from studio.live.late import LateTakes
from studio.live.links import CameraLink, Links
from studio.live.recorder import Key, Recorder
from studio.take.raw import camera_frame
from studio.wire import Kept, Late, SkeletonFrame, check_hello, decode

MAX_STARTS = 15
"""Earlier starts of one client whose frames are taken in on one connection."""


class Keeping:
    """Answers the messages `kept` and `late`; methods may be called from any thread."""

    def __init__(self, links: Links, engine: Engine, late: LateTakes, clock_ns: Callable[[], int]) -> None:
        self._links = links
        self._engine = engine
        self._late = late
        self._clock_ns = clock_ns

    def kept(self, link: CameraLink, message: Kept) -> None:
        """A client keeps frames of a take: it is told which of them are on the disk, now and whenever more are.

        Raises:
            FormatError: frames of another camera. CameraRefused: see `CameraLink`.
        """
        self._links.check(link, self._clock_ns())
        if message.hello is not None:
            if message.hello.name != link.name or message.hello.boot_id != message.boot_id:
                raise FormatError(
                    "kept frames must be of the camera's own name and of the start that they name"
                )
            check_hello(message.hello)
            link.hellos = {**dict(list(link.hellos.items())[-MAX_STARTS:]), message.boot_id: message.hello}
        hello = link.hello_of(message.boot_id)
        if hello is None:
            raise FormatError("frames of an earlier start are kept, but its hello is not told")
        recording = self._engine.recording
        if recording is not None and recording.recorder.take_id == message.take_id:
            key = (link.name, message.boot_id)
            link.kept[message.take_id, message.boot_id] = message.first
            recording.recorder.keeps(key, message.first, message.last)
            link.send(recording.recorder.ack(key, message.first))
            if self._engine.recording is recording:
                return
        self._late.kept(message.take_id, hello, message.first, link.send)

    def late(self, link: CameraLink, message: Late, arrival_ns: int) -> None:
        """Take in a frame that the client kept and sends again.

        Raises:
            FormatError: not a frame of the camera's. CameraRefused: see `CameraLink`.
        """
        self._links.check(link, arrival_ns)
        hello = link.hello_of(message.boot_id)
        inner = decode(message.data)
        if hello is None or not isinstance(inner, SkeletonFrame):
            raise FormatError(
                "a late message must hold a skeleton of a start of the client that it has told of"
            )
        frame = camera_frame(link.name, hello.joint_set, inner)
        recording = self._engine.recording
        if recording is not None and recording.recorder.take_id == message.take_id:
            self._engine.put(Arrived(frame, message.data, arrival_ns, hello, late=True))
        else:
            self._late.frame(message.take_id, hello, frame, message.data, arrival_ns, link.send)

    def synced(self, recorder: Recorder, keys: set[Key], *, ended: bool = False) -> None:
        """More of a take is on the disk: tell those who keep its frames; `ended`: nothing more comes."""
        for link in self._links.all():
            for (take_id, boot_id), first in list(link.kept.items()):
                if take_id != recorder.take_id:
                    continue
                key = (link.name, boot_id)
                if ended or key in keys:
                    link.send(recorder.ack(key, first, ended=ended))
                if ended:
                    link.kept.pop((take_id, boot_id), None)
