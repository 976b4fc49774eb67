"""Starts and stops the takes of the live stage, and informs the camera clients."""

import logging
import shutil
import threading
from collections.abc import Callable
from pathlib import Path

from studio.engine.base.errors import StudioError, TakeError
from studio.engine.base.sentences import say
from studio.engine.rigid_bodies.reading import BodyAxes
from studio.engine.timecode.timecode import TimecodeRate
from studio.live.calibration.performers import FOLDER as PERFORMERS
from studio.live.cameras.links import CameraLink, Links
from studio.live.engine import Engine
from studio.live.keeping.keeping import Keeping
from studio.live.keeping.resume import marker_of
from studio.live.recording.recorder import Recorder
from studio.live.recording.recording import LiveRecording, recording_message
from studio.live.states import RecordStarted, RecordStopped
from studio.rigid_bodies.content import PacketContent
from studio.rigid_bodies.incoming import IncomingBodies
from studio.take.folder.marker import STOPPING, remove_marker, write_marker
from studio.take.library.sessions import new_take_path, session_of_today, take_path
from studio.take.raw.live_log import BodiesEvent, MarkersEvent, TimecodeEvent
from studio.timecode.incoming import OFF, IncomingTimecode

RESERVED_SESSIONS = ("blind", "calibrations", PERFORMERS, "rigs", "shares")
"""Folders of the stage and the server next to those of sessions."""

_log = logging.getLogger(__name__)


class RecordingControl:
    """Takes of the live stage, one at a time. `start`, `stop` and `end_broken` wait for the engine or the disk.

    `on_recorded` is called with each start and stop (a `RecordStopped`), and must return at once.
    """

    def __init__(
        self,
        sessions: Path,
        engine: Engine,
        links: Links,
        keeping: Keeping,
        timecode: IncomingTimecode,
        bodies: IncomingBodies,
        clock_ns: Callable[[], int],
    ) -> None:
        self.on_recorded: Callable[[RecordStarted], object] = lambda what: None
        self._sessions = sessions
        self._engine = engine
        self._links = links
        self._keeping = keeping
        self._timecode = timecode
        self._bodies = bodies
        self._clock_ns = clock_ns
        self._one_at_a_time = threading.Lock()
        self._told_lock = threading.Lock()
        timecode.on_reading = self._timecode_read
        bodies.on_heard = self._bodies_heard

    @property
    def name(self) -> str | None:
        """`<session>/<take>` of the recording under way, or None."""
        recording = self._engine.recording
        return None if recording is None else recording.name

    def welcomed(self, link: CameraLink) -> None:
        """Tell a welcomed client whether a take is being recorded, once the take's file has the client."""
        recording = self._engine.recording
        if recording is None:
            link.send(recording_message(None))
        else:
            recording.recorder.when_written(lambda: self._tell_active(recording, [link]))

    def start(self, session: str | None = None, take: str | None = None, notes: str = "") -> RecordStarted:
        """Start a take; waits. By default the session is the date and the take the next number.

        Raises:
            TakeError: a take is being recorded, the name is taken or not allowed, or the disk refuses;
                the stage continues.
        """
        session = session if session is not None else session_of_today()
        with self._one_at_a_time:
            if self._engine.recording is not None:
                raise TakeError(
                    "recording.take_under_way",
                    "take {name} is being recorded already; stop it first",
                    name=self.name,
                )
            if session in RESERVED_SESSIONS:
                raise TakeError(
                    "recording.session_reserved",
                    "session name {name!r} is not allowed: the stage keeps files of its own there",
                    name=session,
                )
            path = (
                new_take_path(self._sessions, session)
                if take is None
                else take_path(self._sessions, session, take)
            )
            rate = None if self._timecode.chosen == OFF else self._timecode.rate.name
            recorder = Recorder.create(path, session=session, name=path.name, timecode_rate=rate)
            recorder.on_synced = lambda keys: self._keeping.synced(recorder, keys)
            recorder.take.meta["notes"] = notes
            recording = LiveRecording(recorder, self._clock_ns())
            try:
                write_marker(self._sessions, marker_of(recording, self._clock_ns()))
                calibration = self._engine.call(lambda: self._engine.attach(recording))
                written = threading.Event()
                recorder.when_written(written.set)
                written.wait()
                recorder.save_cameras()
                recording.save_performers()
                if calibration is not None:
                    recorder.take.add_calibration(calibration, use=True)
            except BaseException:
                if self._engine.recording is not None:
                    self._engine.call(self._engine.detach)
                recorder.close()
                remove_marker(self._sessions)
                shutil.rmtree(path, ignore_errors=True)
                raise
            known = [
                link for link in self._links.all() if recorder.owed.joined((link.name, link.hello.boot_id))
            ]
            self._tell_active(recording, known)
            started = RecordStarted(session, path.name)
            self.on_recorded(started)
            return started

    def stop(self) -> RecordStopped:
        """End the take and save the live solve; waits.

        Raises:
            TakeError: nothing is being recorded.
            StudioError: the disk refuses.
        """
        with self._one_at_a_time:
            recording = self._engine.recording
            if recording is None:
                raise TakeError("recording.nothing", "nothing is being recorded; start a recording first")
            recording.stopping = True
            try:
                write_marker(self._sessions, marker_of(recording, self._clock_ns(), state=STOPPING))
            except StudioError as error:  # a full disk must not keep a recording from ending
                _log.warning("the end of the recording could not be noted: %s", error)
            self._engine.call(self._engine.detach)
            if recording.bodies_came:
                recording.known_bodies = self._bodies.settings.in_take()
            with self._told_lock:
                for link in self._links.all():
                    link.send(recording_message(None, recording))
            try:
                stopped = recording.save()
                self.on_recorded(stopped)
                return stopped
            finally:
                self._keeping.synced(recording.recorder, set(), ended=True)
                remove_marker(self._sessions)

    def _timecode_read(self, time_ns: int, frame: int, rate: TimecodeRate, source: str) -> None:
        recording = self._engine.recording
        if recording is not None:
            recording.add_timecode(time_ns, TimecodeEvent(frame, rate.name, source))

    def _bodies_heard(self, time_ns: int, axes: BodyAxes, heard: PacketContent) -> None:
        recording = self._engine.recording
        if recording is not None and heard.bodies:
            recording.add_bodies(time_ns, BodiesEvent(axes, heard.bodies))
        if recording is not None and heard.markers is not None:
            recording.add_bodies(time_ns, MarkersEvent(axes, heard.markers))

    def end_broken(self) -> None:
        """End a take that can no longer be written, keep its data, and report the problem."""
        recording = self._engine.recording
        if recording is None:
            return
        self._engine.ended_problem = recording.recorder.problem
        try:
            self.stop()
        except StudioError as error:
            self._engine.ended_problem = say(
                "text.both", "{one}; {other}", one=recording.recorder.problem, other=error
            )
            _log.error("the recording ended: %s", error)

    def _tell_active(self, recording: LiveRecording, links: list[CameraLink]) -> None:
        """Tell clients that a take is being recorded, unless it has ended meanwhile.

        Frames that a client keeps from then on belong to the take, whatever happens to this program.
        """
        with self._told_lock:
            if self._engine.recording is recording:
                for link in links:
                    link.send(recording_message(recording))
