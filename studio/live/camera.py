"""What the live stage knows of one camera: its link, its clock, and the figures of its last seconds."""

from collections import deque
from typing import Any

import numpy as np

from studio.engine.clock import ClockEstimator
from studio.engine.errors import StudioError
from studio.engine.frames import CameraFrame, ClockModel
from studio.wire import Hello, Status

SILENT_NS = 1_500_000_000
"""A connected camera that sent no frame for this long is called silent."""

RECENT = 90
"""Frames kept per camera for a provisional calibration."""


class CameraRefused(StudioError):
    """A camera client that the server does not take; `code` names why, for programs."""

    def __init__(self, code: str, reason: str) -> None:
        super().__init__(reason)
        self.code = code


class LiveCamera:
    """State of one camera on the engine thread, kept when its client leaves so that the status can tell."""

    def __init__(self, hello: Hello) -> None:
        self.hello = hello
        self.connected = True
        self.reason = ""
        self.estimator = ClockEstimator()
        self.clock: ClockModel | None = None
        self.recent: deque[CameraFrame] = deque(maxlen=RECENT)
        self.newest_device_ns: int | None = None
        self.frames = 0
        self.skipped = 0
        self.errors = 0
        self.client: Status | None = None
        self._arrivals: deque[tuple[int, int]] = deque(maxlen=120)

    @property
    def name(self) -> str:
        return self.hello.name

    def rejoin(self, hello: Hello) -> None:
        """Take in the camera's next connection; another start of the client has another clock."""
        if hello.boot_id != self.hello.boot_id:
            self.estimator = ClockEstimator()
            self.clock = None
            self.newest_device_ns = None
            self.recent.clear()
            self._arrivals.clear()
        self.hello = hello
        self.connected = True
        self.reason = ""

    def leave(self, reason: str, *, error: bool) -> None:
        self.connected = False
        self.reason = reason
        self.errors += error

    def saw(self, frame: CameraFrame, arrival_ns: int) -> None:
        """Count a frame, given to the pipeline or not."""
        self.frames += 1
        self._arrivals.append((arrival_ns, frame.device_time_ns))

    def took(self, frame: CameraFrame) -> None:
        """Note a frame that the pipeline was given."""
        self.recent.append(frame)
        self.newest_device_ns = frame.device_time_ns

    def status(self, now_ns: int, *, reference: bool, calibrated: bool) -> dict[str, Any]:
        """Return the camera's part of the stage's status; times on the server's clock [ns]."""
        recent = [(a, d) for a, d in self._arrivals if now_ns - a < 2_000_000_000]
        state, reason = self._state(now_ns, calibrated)
        model = self.estimator.model
        round_trip = self.estimator.round_trip_ns
        latency = jitter = None
        if model is not None and recent:
            latencies = np.array([(a - model.stage_ns(d)) * 1e-6 for a, d in recent])
            latency, jitter = round(float(np.median(latencies)), 2), round(float(latencies.std()), 2)
        return {
            "device": self.hello.device,
            "joint_set": self.hello.joint_set,
            "connected": self.connected,
            "reference": reference,
            "calibrated": calibrated,
            "state": state,
            "reason": reason,
            "fps": _rate([a for a, _ in recent]),
            "latency_ms": latency,
            "jitter_ms": jitter,
            "clock": {
                "offset_ms": None if self.clock is None else round(self.clock.offset_ns * 1e-6, 3),
                "drift_ppm": None if self.clock is None else round(self.clock.drift_ppm, 2),
                "round_trip_ms": None if round_trip is None else round(round_trip * 1e-6, 3),
                "source": "exchange" if self.estimator.exchanged else "arrival",
            },
            "frames": self.frames,
            "skipped": self.skipped,
            "errors": self.errors,
            "dropped_by_client": None if self.client is None else self.client.frames_dropped,
            "message": "" if self.client is None else self.client.message,
        }

    def _state(self, now_ns: int, calibrated: bool) -> tuple[str, str]:
        if not self.connected:
            return "gone", self.reason or "the client has left"
        if not self._arrivals:
            return "silent", "connected, no frame yet"
        silent_ns = now_ns - self._arrivals[-1][0]
        if silent_ns > SILENT_NS:
            return "silent", f"no frame for {silent_ns * 1e-9:.0f} s"
        if self.reason:
            return "trouble", self.reason
        if not calibrated:
            return "live", "not in the calibration: its frames are recorded but not used; calibrate the stage"
        return "live", ""


def _rate(arrivals_ns: list[int]) -> float:
    """Frames per second of these arrivals [ns]."""
    if len(arrivals_ns) < 2 or arrivals_ns[-1] <= arrivals_ns[0]:
        return 0.0
    return round((len(arrivals_ns) - 1) / ((arrivals_ns[-1] - arrivals_ns[0]) * 1e-9), 1)
