"""The live stage as the server uses it: safe from any thread. `engine` does the work."""

import time
from collections.abc import Callable
from pathlib import Path

from msgspec import structs

from studio.engine.base.errors import FormatError, SettingsError, TakeError
from studio.engine.base.sentences import system_says
from studio.engine.calibration.quality.verdict import in_shoes
from studio.engine.calibration.views.seen.known_lens import KnownLenses
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import StepResult
from studio.engine.model.settings.settings import SolveSettings, preset
from studio.live.borrowed import borrow
from studio.live.calibration.kept import load_last_calibration
from studio.live.calibration.performers import load_profile
from studio.live.calibration.tpose import COUNTDOWN_S
from studio.live.cameras.links import CameraLink, Links, Send
from studio.live.cameras.newest_depth import ArrivedDepth
from studio.live.cameras.previews import Previews
from studio.live.engine import Engine
from studio.live.inbox import Arrived, ClockExchange, Left, Reported
from studio.live.keeping.keeping import Keeping
from studio.live.keeping.late import LateTakes
from studio.live.keeping.resume import take_up
from studio.live.latest import Latest
from studio.live.performers.cast import CastMember
from studio.live.recording_control import RecordingControl
from studio.live.states import RecordStarted, RecordStopped, RefusedLinks, StageStatus
from studio.live.status import stage_status
from studio.live.subscribers import Callback, Subscribers
from studio.rigid_bodies.incoming import IncomingBodies
from studio.take.folder.marker import read_marker
from studio.take.folder.names import check_name
from studio.take.raw.frames import camera_frame
from studio.take.raw.records import depth_camera
from studio.timecode.incoming import IncomingTimecode
from studio.wire import ClockSample, DepthImage, Hello, SkeletonFrame, Status, depth_array

CALIBRATION_S = 34.0
"""A T-pose of 3 s and a walk of 30 s, with a second to begin."""

MAX_CALIBRATION_S = 300.0
MAX_COUNTDOWN_S = 60.0


class LiveStage:
    """The live stage. Call `start` first and `close` at the end.

    `keeping` handles frames that clients keep, `previews` their small depth images, `timecode` and `bodies` what
    is received, `recordings` starts and stops takes.
    Methods that say "waits" wait for the engine thread or the disk, so they must not run on an event loop.
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
            raise TakeError(
                "file.no_folder",
                "cannot make folder {path}: {error}; choose another",
                path=sessions,
                error=system_says(error),
            ) from error
        self.sessions = sessions
        self._marker = read_marker(sessions)
        offset_ns = 0 if self._marker is None else self._marker.clock_offset_ns(clock_ns)
        self.clock_ns = clock_ns if offset_ns == 0 else lambda: clock_ns() + offset_ns
        self._links = Links()
        self.previews = Previews(self._links, self.clock_ns)
        self._late = LateTakes(sessions)
        self._subscribers = Subscribers()
        self._refused = RefusedLinks()
        self.timecode = IncomingTimecode(self.clock_ns)
        self.bodies = IncomingBodies(sessions, self.clock_ns)
        self._engine = Engine(
            clock_ns=self.clock_ns,
            settings=preset("studio") if settings is None else settings,
            folder=sessions,
            calibration=load_last_calibration(sessions / "calibrations"),
            subscribers=self._subscribers,
            on_broken=lambda: self.recordings.end_broken(),
            previews=self.previews,
            describe=stage_status,
            timecode=self.timecode,
            bodies=self.bodies,
        )
        self.keeping = Keeping(self._links, self._engine, self._late, self.clock_ns)
        self.recordings = RecordingControl(
            sessions, self._engine, self._links, self.keeping, self.timecode, self.bodies, self.clock_ns
        )

    def start(self, *, prepare: bool = True) -> None:
        """Start the threads; resume a take that the server's end interrupted. Poses follow after `prepare`."""
        marker, self._marker = self._marker, None
        if marker is not None:
            take_up(self._engine, self.sessions, marker, self.clock_ns(), self.keeping.synced)
        self._engine.start()
        self._late.start()
        if prepare:
            self.prepare()

    def prepare(self, *, now: bool = False) -> None:
        """Load and compile the code of the first pose on a thread: `now`, or once there is a camera or a
        calibration."""
        self._engine.prepare(now=now)

    def close(self) -> None:
        """Save a recording under way and end the threads; waits."""
        if self.recording_name() is not None:
            self.stop_recording()
        self.timecode.close()
        self.bodies.close()
        self._engine.close()
        self._late.close()

    # --- what it makes

    @property
    def results(self) -> Latest[StepResult]:
        """The newest step of the pipeline."""
        return self._engine.results

    def subscribe(self, callback: Callback, *, raw: bool = False) -> Callable[[], None]:
        """Call `callback` with every step, on the engine thread; return a function that ends this.

        See `Subscribers`.
        """
        return self._subscribers.add(callback, raw=raw)

    def status(self) -> StageStatus:
        """Return the status, at most a fifth of a second old while the stage runs."""
        return structs.replace(self._engine.status, refused_links=self._refused)

    def calibration(self) -> Calibration | None:
        """Return the calibration in use, with latency corrections as clocks."""
        return self._engine.stage_calibration

    # --- cameras

    def join(self, hello: Hello, *, send: Send = lambda message: None, local: bool = False) -> CameraLink:
        """Add a camera that has passed `wire.check_hello`; waits.

        Args:
            hello: the client's.
            send: sends the client a message; safe from any thread, never waits.
            local: the client runs on this machine.

        Raises:
            CameraRefused: a camera of that name is connected.
        """
        link = CameraLink(hello, False, self.clock_ns(), send)
        self._links.add(link, self.clock_ns())
        link.reference = self._engine.call(lambda: self._engine.join_camera(hello, local=local))
        return link

    def leave(self, link: CameraLink, reason: str, *, error: bool = False) -> None:
        """Handle the end of a camera's connection; `error`: because of what the client sent."""
        if self._links.remove(link):
            self._engine.put(Left(link.name, reason, error))

    def choose_reference(self, name: str) -> None:
        """Make a camera's clock the stage clock; waits.

        Raises:
            SettingsError: no such camera is connected.
            TakeError: a take is being recorded.
        """
        self._engine.call(lambda: self._engine.choose_reference(name))

    def serials_of(self, machine: str) -> dict[str, str]:
        """Return the cameras connected from a machine, by the serial number of their devices, if they have one."""
        return {
            link.hello.serial: link.name
            for link in self._links.all()
            if link.hello.serial and link.hello.machine == machine
        }

    def refuse(self, reason: str) -> None:
        """Count a refused connection."""
        self._refused = RefusedLinks(self._refused.count + 1, reason)

    def frame(self, link: CameraLink, message: SkeletonFrame, data: bytes, arrival_ns: int) -> None:
        """Handle a frame, `data` as received.

        Raises:
            FormatError: it does not fit the camera's joint set.
            CameraRefused: see `CameraLink`.
        """
        self._links.check(link, arrival_ns)
        frame = camera_frame(link.name, link.hello.joint_set, message)
        self._engine.put(Arrived(frame, data, arrival_ns, link.hello))

    def depth(self, link: CameraLink, image: DepthImage, data: bytes, arrival_ns: int) -> None:
        """Handle a depth image, `data` as received. It is used while a take is recorded only.

        Raises:
            FormatError: damaged, or not of the size in the camera's hello.
            CameraRefused: see `CameraLink`.
        """
        self._links.check(link, arrival_ns)
        recording = self._engine.recording
        if recording is None:
            return
        if link.hello.intrinsics is None:
            raise FormatError(
                "camera.no_intrinsics", "a camera that sends depth must tell its intrinsics in hello"
            )
        whole = ArrivedDepth(
            depth_camera(link.hello.intrinsics),
            depth_array(image, link.hello.intrinsics),
            arrival_ns,
            whole=True,
        )
        self.previews.depth.put(link.name, whole)
        recording.recorder.depth(link.hello, image, data, arrival_ns)

    def pending(self) -> int:
        """Number of cameras' messages that wait for the engine thread."""
        return self._engine.pending()

    def clock_sample(self, link: CameraLink, sample: ClockSample) -> None:
        """Handle a finished clock exchange.

        Raises:
            CameraRefused: see `CameraLink`.
        """
        self._links.check(link, self.clock_ns())
        self._engine.put(ClockExchange(link.name, sample))

    def client_status(self, link: CameraLink, status: Status) -> None:
        """Handle a client's own status.

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
            SettingsError: the calibration lacks a named camera.
        """
        self._engine.call(lambda: self._engine.set_settings(settings))

    # --- calibration

    def start_calibration(
        self,
        seconds: float = CALIBRATION_S,
        performer: str = "",
        height_m: float | None = None,
        lenses: KnownLenses | None = None,
    ) -> None:
        """Gather frames for this long, then calibrate with them; the status shows the progress. Waits.

        With a height (without shoes) [m], or the name of a performer who was measured, a walk of somebody of another
        height is refused. Cameras without depth get the size of the stage from the height; `lenses` are theirs.

        Raises:
            SettingsError: a length or height that is not allowed, or a lens for an unknown camera or one with depth.
            TakeError: there is no such performer.
            CalibrationError: no camera, or one is under way.
        """
        if not 1.0 <= seconds <= MAX_CALIBRATION_S:
            raise SettingsError(
                "settings.seconds",
                "seconds={seconds:g} is not allowed; allowed: 1 to {most:g}, such as {usual:g}",
                seconds=seconds,
                most=MAX_CALIBRATION_S,
                usual=CALIBRATION_S,
            )
        height = in_shoes(height_m)
        if height is None and performer:
            height = load_profile(self.sessions, performer).performer.height_m
        self._engine.call(lambda: self._engine.start_calibration(seconds, height, lenses or KnownLenses()))

    def finish_calibration(self) -> None:
        """Calibrate with the frames gathered so far; waits.

        Raises:
            CalibrationError: nothing is being gathered.
        """
        self._engine.call(self._engine.calibrator.finish_gathering)

    def borrow_calibration(self, calibration: Calibration | None) -> None:
        """Use a recording's calibration during its playback (`borrowed`); None: return to the stage's own. Waits."""
        self._engine.call(lambda: borrow(self._engine, calibration))

    def start_tpose(self, name: str = "", countdown_s: float = COUNTDOWN_S) -> None:
        """Count down, then measure the performer in a held T-pose; with a name, store the proportions as a profile.
        Waits.

        Raises:
            SettingsError: a countdown that is not allowed.
            TakeError: a name that is not allowed.
            CalibrationError: the stage is not calibrated, or a T-pose is being measured.
        """
        if not 0.0 <= countdown_s <= MAX_COUNTDOWN_S:
            raise SettingsError(
                "settings.countdown",
                "countdown_s={seconds:g} is not allowed; allowed: 0 to {most:g}",
                seconds=countdown_s,
                most=MAX_COUNTDOWN_S,
            )
        if name:
            check_name("performer", name)
        self._engine.call(lambda: self._engine.start_tpose(name, countdown_s))

    def cancel_tpose(self) -> None:
        """Cancel the measurement; waits."""
        self._engine.call(self._engine.tpose.cancel)

    def use_performer(self, name: str) -> None:
        """Use the proportions of a performer's profile from now on; waits.

        Raises:
            TakeError: there is no such profile.
            CalibrationError: the stage is not calibrated.
        """
        performer = load_profile(self.sessions, name).performer
        self._engine.call(lambda: self._engine.use_performer(performer))

    def members(self) -> dict[int, CastMember]:
        """Return the performers on a stage of several, by number; one performer alone has no entry."""
        return self._engine.members

    def forget_performers(self, name: str | None = None) -> None:
        """Forget a performer, or all but the first one; a forgotten one is a stranger again. Waits.

        Raises:
            TakeError: a take is being recorded.
            SettingsError: there is no performer of that name.
            CalibrationError: the first performer cannot be forgotten.
        """
        self._engine.call(lambda: self._engine.forget_performers(name))

    def rename_performer(self, name: str, new: str) -> None:
        """Rename a performer, also within a recording; waits.

        Raises:
            SettingsError: there is no performer of that name.
            TakeError: a name that is not allowed, or that another one has.
        """
        self._engine.call(lambda: self._engine.rename_performer(name, new))

    def exchange_performers(self, first: str, second: str) -> None:
        """Exchange the identities of two performers from now on; a second call undoes it. Waits.

        Raises:
            SettingsError: there is no performer of one of the names.
        """
        self._engine.call(lambda: self._engine.exchange_performers(first, second))

    def keep_profile(self, name: str) -> None:
        """Store a performer's proportions as the profile of their name; waits.

        Raises:
            SettingsError: there is no performer of that name.
            StudioError: the folder cannot be written.
        """
        self._engine.call(lambda: self._engine.keep_profile(name))

    # --- recording

    def recording_name(self) -> str | None:
        """Return `<session>/<take>` of the recording under way, or None."""
        return self.recordings.name

    def start_recording(
        self, session: str | None = None, take: str | None = None, notes: str = ""
    ) -> RecordStarted:
        """Start a take; waits. By default the session is the date and the take the next number.

        Raises:
            TakeError: a take is being recorded, the name is taken or not allowed, or the disk refuses;
                the stage continues.
        """
        return self.recordings.start(session, take, notes)

    def stop_recording(self) -> RecordStopped:
        """End the take and save the live solve; waits.

        Raises:
            TakeError: nothing is being recorded.
            StudioError: the disk refuses.
        """
        return self.recordings.stop()
