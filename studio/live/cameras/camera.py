"""State of one camera of the live stage: its link, its clock, and the figures of its last seconds."""

from collections import deque
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np

from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import Said, say
from studio.engine.model.frames import CameraFrame, ClockModel
from studio.engine.seeing.pictures.problems import NOBODY
from studio.engine.solve.timing.clock import ClockEstimator
from studio.live.states import CameraStatus, ClockStatus
from studio.wire import Hello, Status

SILENT_NS = 1_500_000_000
"""A connected camera is silent after this long without a frame."""

NOBODY_NS = 1_500_000_000
"""A camera sees nobody after this long without a performer."""

RECENT_NS = 2_000_000_000
SLOW_SHARE = 0.7
LATE_MS = 250.0
BUSY_PERCENT = 85
"""Processor load from which a client with slow frames is limited by its processor."""

SLOW_CODES = ("camera.skips", "phone_says.slow")
"""A client's messages that it is slow; its processor or the network may explain more."""

LOSS_SHARE = 0.05
LEAST_JOINTS = 4

RECENT = 90
"""Frames kept per camera for a provisional calibration."""


class CameraRefused(StudioError):
    """The server refuses a camera client; `refusal` is the reason, for programs."""

    def __init__(self, code: str, reason: str) -> None:
        super().__init__(reason)
        self.refusal = code


class _Arrival(NamedTuple):
    arrival_ns: int
    device_ns: int
    sequence: int
    confidence: float


class LiveCamera:
    """State of one camera on the engine thread, kept for the status when its client leaves.

    Attributes:
        last_clock: the clock of an earlier start or segment, while the present one is unknown.
        local: its client runs on the server's own machine.
    """

    def __init__(self, hello: Hello, *, local: bool = False) -> None:
        self.hello = hello
        self.local = local
        self.connected = True
        self.reason = ""
        self.estimator = ClockEstimator()
        self.clock: ClockModel | None = None
        self.last_clock: ClockModel | None = None
        self.recent: deque[CameraFrame] = deque(maxlen=RECENT)
        self.newest_device_ns: int | None = None
        self.frames = 0
        self.skipped = 0
        self.late = 0
        self.errors = 0
        self.client: Status | None = None
        self.heard_ns: int | None = None
        self._seen_ns: int | None = None
        self._arrivals: deque[_Arrival] = deque(maxlen=240)

    @property
    def name(self) -> str:
        return self.hello.name

    @property
    def clock_id(self) -> str:
        """Identifier of the camera's clock: the start of the client, and the number of its clock's jumps since."""
        segment = self.estimator.segment
        return self.hello.boot_id if segment == 0 else f"{self.hello.boot_id}#{segment}"

    @property
    def newest_sequence(self) -> int | None:
        """Number of the last frame of this start of the client, None before the first."""
        return self._arrivals[-1].sequence if self._arrivals else None

    def rejoin(self, hello: Hello, *, local: bool = False) -> None:
        """Register the camera's next connection; another start of the client has another clock."""
        if hello.boot_id != self.hello.boot_id:
            self.estimator = ClockEstimator()
            self.clock_lost()
            self._arrivals.clear()
        self.hello = hello
        self.local = local
        self.connected = True
        self.reason = ""

    def clock_lost(self) -> None:
        """Register that another clock stamps the camera's frames from now on."""
        self.last_clock = self.clock or self.last_clock
        self.clock = None
        self.newest_device_ns = None
        self.recent.clear()

    def leave(self, reason: str, *, error: bool) -> None:
        self.connected = False
        self.reason = reason
        self.errors += error

    def saw(self, frame: CameraFrame, arrival_ns: int) -> None:
        """Count a frame, whether or not the pipeline receives it."""
        self.frames += 1
        self.heard_ns = arrival_ns
        seen = frame.confidence[frame.confidence > 0.0]
        sure = float(seen.mean()) if len(seen) else 0.0
        self._arrivals.append(_Arrival(arrival_ns, frame.device_time_ns, frame.sequence, sure))
        if len(seen) >= LEAST_JOINTS:
            self._seen_ns = arrival_ns

    def took(self, frame: CameraFrame) -> None:
        """Register a frame that the pipeline received."""
        self.recent.append(frame)
        self.newest_device_ns = frame.device_time_ns

    def step_sequence(self) -> int:
        """Return the first frame stamped by the clock after its last jump, as estimated from arrivals."""
        arrivals = list(self._arrivals)
        moved = [
            abs((b.arrival_ns - b.device_ns) - (a.arrival_ns - a.device_ns) - self.estimator.step_ns)
            for a, b in pairwise(arrivals)
        ]
        if not moved:
            return arrivals[0].sequence if arrivals else 0
        best = int(np.argmin(moved))
        found = moved[best] < abs(self.estimator.step_ns) / 2
        return arrivals[best + 1].sequence if found else arrivals[-1].sequence + 1

    def status(self, now_ns: int, *, reference: bool, calibrated: bool) -> CameraStatus:
        """Return the camera's part of the stage's status; times on the server's clock [ns]."""
        recent = [one for one in self._arrivals if now_ns - one.arrival_ns < RECENT_NS]
        model = self.estimator.model
        latency = jitter = None
        if model is not None and recent:
            latencies = np.array([(one.arrival_ns - model.stage_ns(one.device_ns)) * 1e-6 for one in recent])
            latency, jitter = round(float(np.median(latencies)), 2), round(float(latencies.std()), 2)
        rate, loss = _rate([one.arrival_ns for one in recent]), _loss([one.sequence for one in recent])
        sure = None if not recent else round(float(np.mean([one.confidence for one in recent])), 3)
        state, limited_by, reason = self._state(now_ns, calibrated, rate, latency, loss)
        client = self.client
        return CameraStatus(
            device=self.hello.device,
            joint_set=self.hello.joint_set,
            connected=self.connected,
            reference=reference,
            local=self.local,
            machine=self.hello.machine,
            usb_controller=self.hello.usb_controller,
            calibrated=calibrated,
            state=state,
            limited_by=limited_by,
            reason=reason,
            fps=rate,
            latency_ms=latency,
            jitter_ms=jitter,
            loss_percent=None if loss is None else round(100.0 * loss, 1),
            confidence=sure,
            clock=self._clock_status(),
            frames=self.frames,
            skipped=self.skipped,
            late=self.late,
            errors=self.errors,
            processor_percent=None if client is None else client.processor_percent,
            sending_percent=None if client is None else client.sending_percent,
            dropped_by_client=None if client is None else client.frames_dropped,
            kept_by_client=None if client is None else client.frames_kept,
            not_kept_by_client=None if client is None else client.frames_not_kept,
            unknown_by_client=None if client is None else client.frames_unknown,
            message="" if client is None else client_says(client),
        )

    def slow(self, now_ns: int) -> bool:
        """Whether the camera is connected and has delivered far fewer frames than its rate for some seconds."""
        nominal = self.hello.frames_per_second
        recent = [one.arrival_ns for one in self._arrivals if now_ns - one.arrival_ns < RECENT_NS]
        heard = bool(recent) and now_ns - recent[-1] < SILENT_NS
        return self.connected and heard and self.frames > 2 * nominal and _rate(recent) < SLOW_SHARE * nominal

    def _clock_status(self) -> ClockStatus:
        round_trip, error = self.estimator.round_trip_ns, self.estimator.error_ns
        return ClockStatus(
            offset_ms=None if self.clock is None else round(self.clock.offset_ns * 1e-6, 3),
            drift_ppm=None if self.clock is None else round(self.clock.drift_ppm, 2),
            round_trip_ms=None if round_trip is None else round(round_trip * 1e-6, 3),
            error_ms=None if error is None else round(error * 1e-6, 3),
            source="exchange" if self.estimator.exchanged else "arrival",
            jumps=self.estimator.segment,
        )

    @property
    def _told(self) -> str:
        """The client's own message; "" where the frames already show what it says: slow, or nobody seen."""
        if self.client is None or self.client.message_code in (NOBODY.code, *SLOW_CODES):
            return ""
        return client_says(self.client)

    def _state(
        self, now_ns: int, calibrated: bool, rate: float, latency_ms: float | None, loss: float | None
    ) -> tuple[Literal["live", "trouble", "silent", "gone"], str, str]:
        """Return the state, the limit of the camera's rate ("" = none), and both in words."""
        if not self.connected:
            return "gone", "network", self.reason or say("camera.left", "the client has left")
        if not self._arrivals:
            return "silent", "no_frames", say("camera.no_frame_yet", "connected, no frame yet")
        silent_ns = now_ns - self._arrivals[-1].arrival_ns
        if silent_ns > SILENT_NS:
            heard = self.heard_ns is not None and now_ns - self.heard_ns < SILENT_NS
            words = (
                self._told or say("camera.no_frames", "the client is there, its camera gives none")
                if heard
                else say("camera.not_heard", "nothing is heard of the client")
            )
            return (
                "silent",
                "no_frames" if heard else "network",
                say(
                    "camera.silent",
                    "no frame for {seconds:.0f} s: {words}",
                    seconds=silent_ns * 1e-09,
                    words=words,
                ),
            )
        if self.reason:
            return "trouble", "clock", self.reason
        if self._told:
            return "trouble", "", self._told
        nominal = self.hello.frames_per_second
        late, lossy = (latency_ms or 0.0) > LATE_MS, (loss or 0.0) > LOSS_SHARE
        busy = 0 if self.client is None else self.client.processor_percent
        if busy >= BUSY_PERCENT and (late or lossy or self.slow(now_ns)):
            words = say(
                "camera.processor",
                "its machine's processor is {busy} % busy, {rate:.0f} of {nominal:.0f} frames a second: "
                "close other programs there, lower the camera's frame rate, or use a faster machine",
                busy=busy,
                rate=rate,
                nominal=nominal,
            )
            return "trouble", "processor", words
        if latency_ms is not None and late:
            return (
                "trouble",
                "network",
                say("camera.late", "frames come {ms:.0f} ms late: the network is slow", ms=latency_ms),
            )
        if loss is not None and lossy:
            return (
                "trouble",
                "network",
                say(
                    "camera.lossy",
                    "{percent:.0f} % of the frames do not come: the network is slow",
                    percent=100 * loss,
                ),
            )
        if self.client is not None and self.client.message_code in SLOW_CODES:
            return "trouble", "", client_says(self.client)
        if self.slow(now_ns):
            return (
                "live",
                "no_frames",
                say(
                    "camera.slow",
                    "{rate:.0f} instead of {nominal:.0f} frames a second",
                    rate=rate,
                    nominal=nominal,
                ),
            )
        if self._seen_ns is None or now_ns - self._seen_ns > NOBODY_NS:
            return "live", "no_performer", NOBODY
        if not calibrated:
            text = say(
                "camera.not_calibrated",
                "not in the calibration: its frames are recorded but not used; calibrate the stage",
            )
            return "live", "", text
        return "live", "", ""


def _rate(arrivals_ns: list[int]) -> float:
    """Frames per second of these arrivals [ns]."""
    if len(arrivals_ns) < 2 or arrivals_ns[-1] <= arrivals_ns[0]:
        return 0.0
    return round((len(arrivals_ns) - 1) / ((arrivals_ns[-1] - arrivals_ns[0]) * 1e-9), 1)


def _loss(sequences: list[int]) -> float | None:
    """Share of missing frames, by the gaps in their numbers."""
    if len(sequences) < 2:
        return None
    expected = max(sequences) - min(sequences) + 1
    return max(0.0, 1.0 - len(set(sequences)) / expected)


def client_says(client: Status) -> str:
    """Return a client's message to the operator, with its code if it has one."""
    text, code = client.message, client.message_code
    return Said(text, code, dict(client.message_values)) if text and code else text
