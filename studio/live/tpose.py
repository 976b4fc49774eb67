"""Measuring a performer on the calibrated stage: a countdown, a T-pose that is seen to be held, proportions.

The pose is found in the fused joints; while it is poor the status says what is wrong with it. The proportions come
from the cameras' frames of the hold, computed in a process of its own.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from studio.engine.calibration.calibrate import with_performer
from studio.engine.calibration.result import Calibration, Performer
from studio.engine.calibration.tpose import tpose_problems
from studio.engine.errors import CalibrationError, StudioError
from studio.engine.frames import CameraFrame, StepResult
from studio.worker import run_in_process

_log = logging.getLogger(__name__)

COUNTDOWN_S = 5.0
HOLD_S = 2.0
PATIENCE_S = 30.0
"""How long after the countdown a good pose is waited for."""

_LOOK_S = 0.5
_UP = np.array([0.0, 0.0, 1.0])
_BUSY = ("countdown", "holding", "computing")


@dataclass
class TPose:
    """The last T-pose asked for; `state`: idle, countdown, holding, computing, done or failed.

    Attributes:
        name: the performer's; empty = measured for the stage only.
        seconds_left: of the countdown, or of the hold [s].
        problems: what is wrong with the pose, in words for the performer.
        height_m: as measured.
    """

    state: str = "idle"
    name: str = ""
    seconds_left: float = 0.0
    problems: list[str] = field(default_factory=list)
    message: str = ""
    height_m: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Return it as the status tells it."""
        return {**vars(self), "seconds_left": round(max(self.seconds_left, 0.0), 1)}


class TPoseCapture:
    """One T-pose at a time; its methods belong to the engine thread.

    `report` is called from a worker thread with the performer, or why there is none; it must hand over to the engine
    thread, which then calls `finish`.
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

    def start(self, name: str, countdown_s: float, now_ns: int) -> None:
        """Begin the countdown.

        Raises:
            CalibrationError: one is under way.
        """
        if self.busy:
            raise CalibrationError("a T-pose is being measured; wait until it is done")
        self.pose = TPose("countdown", name, countdown_s)
        self._began_ns = now_ns + round(countdown_s * 1e9)
        self._held_since_ns = None
        self._joints.clear()
        self._frames = {}

    def cancel(self) -> None:
        """Leave off."""
        if self.pose.state in ("countdown", "holding"):
            self.pose = TPose(message="cancelled")

    def add_frame(self, frame: CameraFrame) -> None:
        """Take in a camera's frame, kept while the pose is held."""
        if self._held_since_ns is not None and self.pose.state == "holding":
            self._frames.setdefault(frame.camera, []).append(frame)

    def add_result(self, result: StepResult, now_ns: int) -> None:
        """Look at the newest fused joints."""
        if self.pose.state not in ("countdown", "holding"):
            return
        self._joints.append((result.frame_set.stage_time_ns, result.fused.positions))
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
        """Go on with time; `clocked` returns the calibration with the cameras' present clocks."""
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
            pose.state, pose.message = "computing", "measuring"
            frames, self._frames = self._frames, {}
            threading.Thread(target=self._compute, args=(placed, frames), name="t-pose", daemon=True).start()
        elif (now_ns - self._began_ns) * 1e-9 > PATIENCE_S:
            why = "; ".join(pose.problems) or "no performer was seen"
            self.pose = replace(pose, state="failed", message=f"no T-pose was held for {HOLD_S:.0f} s: {why}")

    def _compute(self, calibration: Calibration, frames: dict[str, list[CameraFrame]]) -> None:
        try:
            measured = run_in_process(measure_performer, calibration, frames)
        except StudioError as error:
            self._report(None, str(error))
        except Exception as error:  # the boundary of the thread
            _log.exception("measuring a performer failed")
            self._report(None, f"measuring failed: {error!r}; see the server's log")
        else:
            self._report(measured, "" if measured is not None else "too little of the body was seen")

    def finish(self, performer: Performer | None, problem: str) -> None:
        """Take in what was measured."""
        if performer is None:
            self.pose = replace(self.pose, state="failed", message=problem)
        else:
            message = f"measured: {performer.height_m:.2f} m"
            self.pose = replace(self.pose, state="done", message=message, height_m=performer.height_m)


def measure_performer(calibration: Calibration, frames: dict[str, list[CameraFrame]]) -> Performer | None:
    """Return the proportions in frames of a held T-pose, None where too little was seen; runs in a worker process."""
    ordered = {name: sorted(mine, key=lambda frame: frame.device_time_ns) for name, mine in frames.items()}
    return with_performer(replace(calibration, performer=None), ordered).performer
