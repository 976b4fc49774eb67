"""Measurement of a performer on the calibrated stage: a countdown, a held T-pose, proportions.

The pose is found in the joints of all cameras; while it is poor, the status names its faults. The proportions are
computed from the cameras' frames of the hold, in a separate process.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from msgspec.structs import replace as changed
from numpy.typing import NDArray

from studio.engine.base.errors import CalibrationError, StudioError
from studio.engine.base.sentences import say
from studio.engine.calibration.calibrate import with_performer
from studio.engine.calibration.performer.tpose import tpose_problems
from studio.engine.model.calibration import Calibration, Performer
from studio.engine.model.frames import CameraFrame
from studio.live.states import TPose
from studio.worker import run_in_process

_log = logging.getLogger(__name__)

COUNTDOWN_S = 5.0
HOLD_S = 2.0
PATIENCE_S = 30.0
"""Longest wait for a good pose after the countdown."""

_LOOK_S = 0.5
_UP = np.array([0.0, 0.0, 1.0])
_BUSY = ("countdown", "holding", "computing")


class TPoseCapture:
    """One T-pose at a time; its methods belong to the engine thread.

    A worker thread calls `report` with the performer, or the reason why there is none. `report` must pass it to the
    engine thread, which then calls `finish`.
    """

    def __init__(self, report: Callable[[Performer | None, str], None]) -> None:
        self.pose = TPose()
        self._report = report
        self._began_ns = 0
        self._held_since_ns: int | None = None
        self._joints: deque[tuple[int, np.ndarray]] = deque()
        self._frames: dict[str, list[CameraFrame]] = {}

    @property
    def busy(self) -> bool:
        return self.pose.state in _BUSY

    def status(self) -> TPose:
        """Return a snapshot of the last T-pose's state."""
        return changed(self.pose, seconds_left=round(max(self.pose.seconds_left, 0.0), 1))

    def start(self, name: str, countdown_s: float, now_ns: int) -> None:
        """Begin the countdown.

        Raises:
            CalibrationError: one is under way.
        """
        if self.busy:
            raise CalibrationError("tpose.under_way", "a T-pose is being measured; wait until it is done")
        self.pose = TPose("countdown", name, countdown_s)
        self._began_ns = now_ns + round(countdown_s * 1e9)
        self._held_since_ns = None
        self._joints.clear()
        self._frames = {}

    def cancel(self) -> None:
        """Cancel the measurement."""
        if self.pose.state in ("countdown", "holding"):
            self.pose = TPose(message=say("tpose.cancelled", "cancelled"))

    def add_frame(self, frame: CameraFrame) -> None:
        """Add a camera's frame, kept while the pose is held."""
        if self._held_since_ns is not None and self.pose.state == "holding":
            self._frames.setdefault(frame.camera, []).append(frame)

    def add_joints(self, stage_time_ns: int, positions: NDArray[np.float64], now_ns: int) -> None:
        """Check the newest joints in the stage frame [m], shape (21, 3)."""
        if self.pose.state not in ("countdown", "holding"):
            return
        self._joints.append((stage_time_ns, positions))
        while self._joints[-1][0] - self._joints[0][0] > _LOOK_S * 1e9:
            self._joints.popleft()
        span_s = (self._joints[-1][0] - self._joints[0][0]) * 1e-9
        if span_s < 0.8 * _LOOK_S:
            return
        joints = np.stack([joints for _, joints in self._joints])
        self.pose.problems = tpose_problems(joints, _UP, (len(joints) - 1) / span_s)
        if self.pose.state == "holding" and self.pose.problems:
            self._held_since_ns, self._frames = None, {}
        elif self.pose.state == "holding" and self._held_since_ns is None:
            self._held_since_ns = now_ns

    def update(self, now_ns: int, clocked: Callable[[], Calibration | None]) -> None:
        """Update with time; `clocked` returns the calibration with the cameras' present clocks."""
        pose = self.pose
        if pose.state == "countdown":
            pose.seconds_left = (self._began_ns - now_ns) * 1e-9
            if pose.seconds_left <= 0:
                pose.state = "holding"
        if pose.state != "holding":
            return
        held_s = 0.0 if self._held_since_ns is None else (now_ns - self._held_since_ns) * 1e-9
        pose.seconds_left = HOLD_S - held_s
        placed = clocked() if held_s >= HOLD_S else None
        if placed is not None and self._frames:
            pose.state, pose.message = "computing", say("tpose.measuring", "measuring")
            frames, self._frames = self._frames, {}
            threading.Thread(target=self._compute, args=(placed, frames), name="t-pose", daemon=True).start()
        elif (now_ns - self._began_ns) * 1e-9 > PATIENCE_S:
            why = pose.problems or say("tpose.nobody", "no performer was seen")
            pose.state, pose.message = (
                "failed",
                say(
                    "tpose.not_held",
                    "no T-pose was held for {seconds:.0f} s: {why}",
                    seconds=HOLD_S,
                    why=why,
                ),
            )

    def _compute(self, calibration: Calibration, frames: dict[str, list[CameraFrame]]) -> None:
        try:
            measured = run_in_process("studio.live.calibration.tpose:measure_performer", calibration, frames)
        except StudioError as error:
            self._report(None, error.sentence)
        except Exception as error:  # the boundary of the thread
            _log.exception("measuring a performer failed")
            self._report(
                None, say("tpose.failed", "measuring failed: {error!r}; see the server's log", error=error)
            )
        else:
            self._report(
                measured,
                ""
                if measured is not None
                else say("tpose.too_little_seen", "too little of the body was seen"),
            )

    def finish(self, performer: Performer | None, problem: str) -> None:
        """Handle the result."""
        pose = self.pose
        if performer is None:
            pose.state, pose.message = "failed", problem
        else:
            pose.state, pose.message = (
                "done",
                say("tpose.measured", "measured: {m:.2f} m", m=performer.height_m),
            )
            pose.height_m = performer.height_m


def measure_performer(
    calibration: Calibration, frames: dict[str, list[CameraFrame]], moves: bool = False
) -> Performer | None:
    """Return the proportions in frames of a held T-pose, None where too little was seen; runs in a worker process.

    `moves`: the performer holds none, and the feet rarely stand still.
    """
    ordered = {name: sorted(mine, key=lambda frame: frame.device_time_ns) for name, mine in frames.items()}
    return with_performer(replace(calibration, performer=None), ordered, another=moves).performer
