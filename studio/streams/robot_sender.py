"""The thread that sends a robot's joint targets, at its own rate."""

import logging
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from msgspec import structs

from studio.engine.base.errors import StudioError
from studio.engine.model.frames import StepResult
from studio.streams.cast import Cast
from studio.streams.channel import Channel, cannot_send
from studio.streams.joint_targets import JointTargets, Load, encoded
from studio.streams.targets import OutputStatus, Target

if TYPE_CHECKING:
    from studio.engine.robots.body.robot import Robot

_log = logging.getLogger(__name__)

HEAD_S = 1.0
"""Interval of the head message, for receivers that start later [s]."""


class JointThread:
    """Passes a robot's joint targets to `send`, one message per period, until `close`."""

    def __init__(
        self,
        load: "Callable[[], Robot]",
        rate_hz: float,
        cast: Cast,
        performer: str,
        send: Callable[[bytes], object],
    ) -> None:
        """Args: `load`: returns the robot, called in the thread; `send`: called there with each message."""
        self._load, self._rate_hz, self._cast, self._performer = load, rate_hz, cast, performer
        self._send = send
        self._closed = threading.Event()
        self._newest: StepResult | None = None
        self.late = 0
        """Number of periods without a message."""
        self.problem = ""
        self._thread = threading.Thread(target=self._run, name="joint targets", daemon=True)
        self._thread.start()

    def add(self, result: StepResult) -> None:
        """Take in a step of the stage; returns at once."""
        self._newest = result

    def close(self) -> None:
        """End the thread; do not wait for a name server that does not answer."""
        self._closed.set()
        self._thread.join(timeout=1.0)

    def _run(self) -> None:
        try:
            targets = JointTargets(self._load(), self._rate_hz, self._cast, self._performer)
        except StudioError as error:
            self.problem = error.sentence
            return
        period_s, due_s, head_s = 1.0 / self._rate_hz, time.monotonic(), 0.0
        taken: StepResult | None = None
        while not self._closed.wait(max(due_s - time.monotonic(), 0.0)):
            now_s = time.monotonic()
            late = int((now_s - due_s) / period_s)
            self.late += late
            due_s += (1 + late) * period_s
            newest = self._newest
            if newest is not None and newest is not taken:
                taken = newest
                targets.take(newest, now_s)
            try:
                if now_s - head_s >= HEAD_S:
                    head_s = now_s
                    self._send(encoded(targets.head()))
                self._send(encoded(targets.message(now_s)))
            except Exception as error:  # boundary of the thread: the target reports it, the stage continues
                self.problem = f"the output failed: {error!r}"
                _log.exception("joint targets failed")


class RobotSender:
    """Sends a robot's joint targets to a target by UDP, until `close`."""

    def __init__(self, target: Target, cast: Cast, load: Load) -> None:
        self.target = target
        self._channel = Channel(target.host, target.port)
        self._sent = self._bytes = 0
        self._problem = ""
        self._thread = JointThread(
            lambda: load(target.robot), target.rate_hz, cast, target.performer, self._send
        )

    def add(self, result: StepResult) -> None:
        """Take in a step of the stage; returns at once."""
        self._thread.add(result)

    def status(self) -> OutputStatus:
        """Return the target with what was sent, and the last error."""
        return OutputStatus(
            **structs.asdict(self.target),
            sent=self._sent,
            dropped=self._thread.late,
            bytes=self._bytes,
            problem=self._thread.problem or self._problem,
        )

    def close(self) -> None:
        """End the thread."""
        self._thread.close()
        self._channel.close()

    def _send(self, message: bytes) -> None:
        try:
            self._channel.send(message)
        except OSError as error:  # later messages may arrive
            self._problem = cannot_send(self.target.host, error)
        else:
            self._problem = ""
            self._sent += 1
            self._bytes += len(message)
