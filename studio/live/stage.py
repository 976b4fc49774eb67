"""The live stage as the server uses it: safe from any thread. The work is done by `engine`."""

import logging
import shutil
import threading
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

from studio.engine.calibration.result import Calibration
from studio.engine.errors import FormatError, SettingsError, StudioError, TakeError
from studio.engine.frames import StepResult
from studio.engine.settings import SolveSettings, preset
from studio.live.borrowed import borrow
from studio.live.calibrations import load_last_calibration
from studio.live.engine import Engine
from studio.live.inbox import Arrived, Left, Measured, Reported
from studio.live.keeping import Keeping
from studio.live.late import LateTakes
from studio.live.latest import Latest
from studio.live.links import CameraLink, Links, Send
from studio.live.performers import FOLDER as PERFORMERS
from studio.live.performers import load_profile
from studio.live.previews import Previews
from studio.live.recorder import Recorder
from studio.live.recording import Recording, recording_message
from studio.live.resume import marker_of, take_up
from studio.live.tpose import COUNTDOWN_S
from studio.take.marker import STOPPING, read_marker, remove_marker, write_marker
from studio.take.names import check_name
from studio.take.raw import camera_frame
from studio.take.sessions import new_take_path, take_path
from studio.wire import ClockSample, DepthImage, Hello, SkeletonFrame, Status, depth_array

CALIBRATION_S = 34.0
"""A T-pose of 3 s and a walk of 30 s, with a second to begin."""

MAX_CALIBRATION_S = 300.0
RESERVED_SESSIONS = ("blind", "calibrations", PERFORMERS, "rigs", "shares")
"""Folders of the stage and the server beside those of sessions."""

MAX_COUNTDOWN_S = 60.0
_log = logging.getLogger(__name__)


class LiveStage:
    """The live stage. `start` it, `close` it at the end.

    `keeping` is what it does about frames that clients keep, `previews` about their small depth images.
    Methods that say "waits" wait for the engine thread or the disk: not for an event loop.
    """

    def __init__(
        self,
        sessions: Path,
        *,
        clock_ns: Callable[[], int] = time.monotonic_ns,
        settings: SolveSettings | None = None,
    ) -> None:
        """Use the last good calibration found in `sessions`; `clock_ns` is a monotonic clock [ns].

        Raises:
            TakeError: the folder cannot be made.
        """
        try:
            sessions.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise TakeError(f"cannot make folder {sessions}: {error.strerror}; choose another") from error
        self.sessions = sessions
        self._marker = read_marker(sessions)
        offset_ns = 0 if self._marker is None else self._marker.clock_offset_ns(clock_ns)
        self.clock_ns = clock_ns if offset_ns == 0 else lambda: clock_ns() + offset_ns
        self._links = Links()
        self.previews = Previews(self._links, self.clock_ns)
        self._late = LateTakes(sessions)
        self._recording_lock = threading.Lock()
        self._subscribers: tuple[Callable[[StepResult], None], ...] = ()
        self._refused: dict[str, Any] = {"count": 0, "last": ""}
        self._engine = Engine(
            clock_ns=self.clock_ns,
            settings=preset("studio") if settings is None else settings,
            folder=sessions,
            calibration=load_last_calibration(sessions / "calibrations"),
            notify=self._notify,
            on_broken=self._end_broken,
            previews=self.previews,
        )
        self.keeping = Keeping(self._links, self._engine, self._late, self.clock_ns)

    def start(self, *, prepare: bool = True) -> None:
        """Start the threads; go on with a take that the server's end cut. Poses come after `prepare`."""
        marker, self._marker = self._marker, None
        if marker is not None:
            take_up(self._engine, self.sessions, marker, self.clock_ns(), self.keeping.synced)
        self._engine.start()
        self._late.start()
        if prepare:
            self.prepare()

    def prepare(self) -> None:
        """Load and compile what the first pose needs, on a thread."""
        self._engine.prepare()

    def close(self) -> None:
        """Save a recording under way and end the threads; waits."""
        if self.recording_name() is not None:
            self.stop_recording()
        self._engine.close()
        self._late.close()

    # --- what it makes

    @property
    def results(self) -> Latest[StepResult]:
        """The newest step of the pipeline."""
        return self._engine.results

    def subscribe(self, callback: Callable[[StepResult], None]) -> Callable[[], None]:
        """Call `callback` with every step, on the engine thread: it must return at once.

        Returns a function that ends it.
        """
        self._subscribers = (*self._subscribers, callback)

        def unsubscribe() -> None:
            self._subscribers = tuple(other for other in self._subscribers if other is not callback)

        return unsubscribe

    def _notify(self, result: StepResult) -> None:
        for callback in self._subscribers:
            callback(result)

    def status(self) -> dict[str, Any]:
        """Return the status as JSON, a fifth of a second old at most while the stage runs."""
        return {**self._engine.status, "refused_links": dict(self._refused)}

    def calibration(self) -> Calibration | None:
        """Return the calibration in use, with latency corrections as clocks."""
        return self._engine.stage_calibration

    # --- cameras

    def join(self, hello: Hello, *, send: Send = lambda message: None, local: bool = False) -> CameraLink:
        """Take in a camera that has passed `wire.check_hello`; waits.

        Args:
            hello: the client's.
            send: hands the client a message; safe from any thread, never waits.
            local: the client runs on this machine.

        Raises:
            CameraRefused: a camera of that name is connected.
        """
        link = CameraLink(hello, False, self.clock_ns(), send)
        self._links.add(link, self.clock_ns())
        link.reference = self._engine.call(lambda: self._engine.join_camera(hello, local=local))
        return link

    def welcomed(self, link: CameraLink) -> None:
        """The client was welcomed: tell it whether a take is being recorded."""
        link.send(recording_message(self._engine.recording))

    def leave(self, link: CameraLink, reason: str, *, error: bool = False) -> None:
        """A camera's connection has ended; `error`: because of what the client sent."""
        if self._links.remove(link):
            self._engine.put(Left(link.name, reason, error))

    def choose_reference(self, name: str) -> None:
        """Make a camera's clock the stage clock; waits.

        Raises:
            SettingsError: no such camera is connected. TakeError: a take is being recorded.
        """
        self._engine.call(lambda: self._engine.choose_reference(name))

    def refuse(self, reason: str) -> None:
        """Count a connection that was refused."""
        self._refused = {"count": self._refused["count"] + 1, "last": reason}

    def frame(self, link: CameraLink, message: SkeletonFrame, data: bytes, arrival_ns: int) -> None:
        """Take in a frame, `data` as it came.

        Raises:
            FormatError: it does not fit the camera's joint set. CameraRefused: see `CameraLink`.
        """
        self._links.check(link, arrival_ns)
        frame = camera_frame(link.name, link.hello.joint_set, message)
        self._engine.put(Arrived(frame, data, arrival_ns, link.hello))

    def depth(self, link: CameraLink, image: DepthImage, data: bytes, arrival_ns: int) -> None:
        """Take in a depth image, `data` as it came: it goes into the take that is recorded, else nowhere.

        Raises:
            FormatError: damaged, or not of the size in the camera's hello. CameraRefused: see `CameraLink`.
        """
        self._links.check(link, arrival_ns)
        recording = self._engine.recording
        if recording is None:
            return
        if link.hello.intrinsics is None:
            raise FormatError("a camera that sends depth must tell its intrinsics in hello")
        depth_array(image, link.hello.intrinsics)
        recording.recorder.depth(link.hello, image, data, arrival_ns)

    def pending(self) -> int:
        """How many messages of cameras wait for the engine thread."""
        return self._engine.pending()

    def clock_sample(self, link: CameraLink, sample: ClockSample) -> None:
        """Take in a finished clock exchange.

        Raises:
            CameraRefused: see `CameraLink`.
        """
        self._links.check(link, self.clock_ns())
        self._engine.put(Measured(link.name, sample))

    def client_status(self, link: CameraLink, status: Status) -> None:
        """Take in a client's own status.

        Raises:
            CameraRefused: see `CameraLink`.
        """
        self._links.check(link, self.clock_ns())
        self._engine.put(Reported(link.name, status))

    # --- settings

    def settings(self) -> SolveSettings:
        """Return the settings in use."""
        return self._engine.settings

    def set_settings(self, settings: SolveSettings) -> None:
        """Use these settings from now on; waits.

        Raises:
            SettingsError: a camera is named that the calibration does not have.
        """
        self._engine.call(lambda: self._engine.set_settings(settings))

    # --- calibration

    def start_calibration(self, seconds: float = CALIBRATION_S, performer: str = "") -> None:
        """Gather frames for so long, then calibrate with them; the status tells how it goes. Waits.

        With a performer's name, a walk that shows somebody of another height is refused.

        Raises:
            SettingsError: a length that is not allowed. TakeError: there is no such performer.
            CalibrationError: no camera, or one is under way.
        """
        if not 1.0 <= seconds <= MAX_CALIBRATION_S:
            raise SettingsError(
                f"seconds={seconds:g} is not allowed; allowed: 1 to {MAX_CALIBRATION_S:g}, "
                f"such as {CALIBRATION_S:g}"
            )
        height_m = load_profile(self.sessions, performer).performer.height_m if performer else None
        self._engine.call(lambda: self._engine.start_calibration(seconds, height_m))

    def finish_calibration(self) -> None:
        """Calibrate with what was gathered so far; waits.

        Raises:
            CalibrationError: nothing is being gathered.
        """
        self._engine.call(self._engine.calibrator.finish_gathering)

    def borrow_calibration(self, calibration: Calibration | None) -> None:
        """Use a recording's calibration while it plays (`borrowed`); None: the stage's own again. Waits."""
        self._engine.call(lambda: borrow(self._engine, calibration))

    def start_tpose(self, name: str = "", countdown_s: float = COUNTDOWN_S) -> None:
        """Count down, then measure the performer in a held T-pose; a name keeps the proportions as a profile. Waits.

        Raises:
            SettingsError: a countdown that is not allowed. TakeError: a name that is not allowed.
            CalibrationError: the stage is not calibrated, or a T-pose is being measured.
        """
        if not 0.0 <= countdown_s <= MAX_COUNTDOWN_S:
            raise SettingsError(
                f"countdown_s={countdown_s:g} is not allowed; allowed: 0 to {MAX_COUNTDOWN_S:g}"
            )
        if name:
            check_name("performer", name)
        self._engine.call(lambda: self._engine.start_tpose(name, countdown_s))

    def cancel_tpose(self) -> None:
        """Leave off measuring; waits."""
        self._engine.call(self._engine.tpose.cancel)

    def use_performer(self, name: str) -> None:
        """Work with the proportions of a performer's profile from now on; waits.

        Raises:
            TakeError: there is no such profile. CalibrationError: the stage is not calibrated.
        """
        performer = load_profile(self.sessions, name).performer
        self._engine.call(lambda: self._engine.use_performer(performer))

    # --- recording

    def recording_name(self) -> str | None:
        """Return `<session>/<take>` of the recording under way, or None."""
        recording = self._engine.recording
        return None if recording is None else recording.name

    def start_recording(self, session: str | None = None, take: str | None = None) -> dict[str, Any]:
        """Begin a take; waits. The session is the date and the take the next number where not given.

        Returns:
            `session` and `take`.

        Raises:
            TakeError: a take is being recorded, the name is taken or not allowed, or the disk refuses;
                the stage goes on.
        """
        session = session if session is not None else datetime.now().astimezone().strftime("%Y-%m-%d")
        with self._recording_lock:
            if self._engine.recording is not None:
                raise TakeError(f"take {self.recording_name()} is being recorded already; stop it first")
            if session in RESERVED_SESSIONS:
                raise TakeError(
                    f"session name {session!r} is not allowed: the stage keeps files of its own there"
                )
            path = (
                new_take_path(self.sessions, session)
                if take is None
                else take_path(self.sessions, session, take)
            )
            recorder = Recorder.create(path, session=session, name=path.name)
            recorder.on_synced = lambda keys: self.keeping.synced(recorder, keys)
            recording = Recording(recorder, self.clock_ns())
            try:
                write_marker(self.sessions, marker_of(recording, self.clock_ns()))
                calibration = self._engine.call(lambda: self._engine.attach(recording))
                recorder.save_cameras()
                if calibration is not None:
                    recorder.take.add_calibration(calibration, use=True)
            except BaseException:
                if self._engine.recording is not None:
                    self._engine.call(self._engine.detach)
                recorder.close()
                remove_marker(self.sessions)
                shutil.rmtree(path, ignore_errors=True)
                raise
            self._tell(recording)
            return {"session": session, "take": path.name}

    def stop_recording(self) -> dict[str, Any]:
        """End the take and save the live solve; waits.

        Returns:
            A summary: `session`, `take`, `seconds`, `frames`, `poses`, `problem`.

        Raises:
            TakeError: nothing is being recorded. StudioError: the disk refuses.
        """
        with self._recording_lock:
            recording = self._engine.recording
            if recording is None:
                raise TakeError("nothing is being recorded; start a recording first")
            recording.stopping = True
            try:
                write_marker(self.sessions, marker_of(recording, self.clock_ns(), state=STOPPING))
            except StudioError as error:  # a full disk must not keep a recording from ending
                _log.warning("the end of the recording could not be noted: %s", error)
            self._engine.call(self._engine.detach)
            self._tell(None, recording)
            try:
                return recording.save()
            finally:
                self.keeping.synced(recording.recorder, set(), ended=True)
                remove_marker(self.sessions)

    def _end_broken(self) -> None:
        """The take cannot be written on: end it in order, keep what there is, and say so."""
        recording = self._engine.recording
        if recording is None:
            return
        self._engine.ended_problem = recording.recorder.problem
        try:
            self.stop_recording()
        except StudioError as error:
            self._engine.ended_problem = f"{recording.recorder.problem}; {error}"
            _log.error("the recording ended: %s", error)

    def _tell(self, recording: Recording | None, ended: Recording | None = None) -> None:
        """Tell every client whether a take is being recorded."""
        for link in self._links.all():
            link.send(recording_message(recording, ended))
