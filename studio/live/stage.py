"""The live stage as the server uses it: safe from any thread. The work is done by `engine`."""

import shutil
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from studio.engine.calibration.result import Calibration
from studio.engine.errors import SettingsError, TakeError
from studio.engine.frames import StepResult
from studio.engine.settings import SolveSettings, preset
from studio.live.calibrations import load_last_calibration
from studio.live.camera import CameraRefused
from studio.live.engine import Engine
from studio.live.inbox import Arrived, Left, Measured, Reported
from studio.live.latest import Latest
from studio.live.recorder import Recorder
from studio.take.raw import camera_frame
from studio.take.sessions import new_take_path, take_path
from studio.wire import ClockSample, Hello, SkeletonFrame, Status

CALIBRATION_S = 34.0
"""A T-pose of 3 s and a walk of 30 s, with a second to begin."""

MAX_CALIBRATION_S = 300.0
LINK_TIMEOUT_NS = 5_000_000_000
"""A client that sent nothing for this long may be replaced by another of its name."""

RESERVED_SESSION = "calibrations"


@dataclass
class CameraLink:
    """One connection of a camera; frames of a connection that was replaced are refused."""

    hello: Hello
    reference: bool
    heard_ns: int

    @property
    def name(self) -> str:
        return self.hello.name


class LiveStage:
    """The live stage. `start` it, `close` it at the end.

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
        self.clock_ns = clock_ns
        self._links: dict[str, CameraLink] = {}
        self._links_lock = threading.Lock()
        self._recording_lock = threading.Lock()
        self._subscribers: tuple[Callable[[StepResult], None], ...] = ()
        self._refused: dict[str, Any] = {"count": 0, "last": ""}
        self._engine = Engine(
            clock_ns=clock_ns,
            settings=preset("studio") if settings is None else settings,
            folder=sessions,
            calibration=load_last_calibration(sessions / "calibrations"),
            notify=self._notify,
        )

    def start(self) -> None:
        """Start the engine thread."""
        self._engine.start()

    def close(self) -> None:
        """Save a recording under way and end the threads; waits."""
        if self.recording_name() is not None:
            self.stop_recording()
        self._engine.close()

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

    def join(self, hello: Hello) -> CameraLink:
        """Take in a camera that has passed `wire.check_hello`; waits.

        Raises:
            CameraRefused: a camera of that name is connected.
        """
        link = CameraLink(hello, False, self.clock_ns())
        with self._links_lock:
            other = self._links.get(hello.name)
            if other is not None and self.clock_ns() - other.heard_ns < LINK_TIMEOUT_NS:
                raise CameraRefused(
                    "name_taken",
                    f"a camera named {hello.name!r} is connected already; give this one another --name",
                )
            self._links[hello.name] = link
        link.reference = self._engine.call(lambda: self._engine.join_camera(hello))
        return link

    def leave(self, link: CameraLink, reason: str, *, error: bool = False) -> None:
        """A camera's connection has ended; `error`: because of what the client sent."""
        with self._links_lock:
            if self._links.get(link.name) is not link:
                return
            del self._links[link.name]
        self._engine.put(Left(link.name, reason, error))

    def refuse(self, reason: str) -> None:
        """Count a connection that was refused."""
        self._refused = {"count": self._refused["count"] + 1, "last": reason}

    def frame(self, link: CameraLink, message: SkeletonFrame, data: bytes, arrival_ns: int) -> None:
        """Take in a frame, `data` as it came.

        Raises:
            FormatError: it does not fit the camera's joint set. CameraRefused: see `CameraLink`.
        """
        self._heard(link, arrival_ns)
        frame = camera_frame(link.name, link.hello.joint_set, message)
        self._engine.put(Arrived(frame, data, arrival_ns))

    def clock_sample(self, link: CameraLink, sample: ClockSample) -> None:
        """Take in a finished clock exchange.

        Raises:
            CameraRefused: see `CameraLink`.
        """
        self._heard(link, self.clock_ns())
        self._engine.put(Measured(link.name, sample))

    def client_status(self, link: CameraLink, status: Status) -> None:
        """Take in a client's own status.

        Raises:
            CameraRefused: see `CameraLink`.
        """
        self._heard(link, self.clock_ns())
        self._engine.put(Reported(link.name, status))

    def _heard(self, link: CameraLink, now_ns: int) -> None:
        if self._links.get(link.name) is not link:
            raise CameraRefused("replaced", f"another client took over the name {link.name!r}")
        link.heard_ns = now_ns

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

    def start_calibration(self, seconds: float = CALIBRATION_S) -> None:
        """Gather frames for so long, then calibrate with them; the status tells how it goes. Waits.

        Raises:
            SettingsError: a length that is not allowed. CalibrationError: no camera, or one is under way.
        """
        if not 1.0 <= seconds <= MAX_CALIBRATION_S:
            raise SettingsError(
                f"seconds={seconds:g} is not allowed; allowed: 1 to {MAX_CALIBRATION_S:g}, "
                f"such as {CALIBRATION_S:g}"
            )
        self._engine.call(lambda: self._engine.start_calibration(seconds))

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
            if session == RESERVED_SESSION:
                raise TakeError(
                    f"session name {session!r} is not allowed: the stage's calibrations lie there"
                )
            path = (
                new_take_path(self.sessions, session)
                if take is None
                else take_path(self.sessions, session, take)
            )
            recorder = Recorder(path, session=session, name=path.name)
            try:
                calibration = self._engine.call(lambda: self._engine.attach(recorder))
                recorder.save_cameras()
                if calibration is not None:
                    recorder.take.add_calibration(calibration, use=True)
            except BaseException:
                if self._engine.recording is not None:
                    self._engine.call(self._engine.detach)
                recorder.close()
                shutil.rmtree(path, ignore_errors=True)
                raise
            return {"session": session, "take": path.name}

    def stop_recording(self) -> dict[str, Any]:
        """End the take and save the live solve; waits.

        Returns:
            A summary: `session`, `take`, `seconds`, `frames`, `poses`, `problem`.

        Raises:
            TakeError: nothing is being recorded. StudioError: the disk refuses.
        """
        with self._recording_lock:
            return self._engine.call(self._engine.detach).save()
