"""The thread that sends frames to one target; the pipeline only appends to its queue."""

import logging
import threading
from collections import deque
from collections.abc import Callable

from msgspec import structs

from studio.engine.base.sentences import say
from studio.engine.model.frames import StepResult
from studio.streams.cast import Cast, Member, steps_of
from studio.streams.channel import Channel, cannot_send
from studio.streams.rokoko import RokokoActor, RokokoEncoder
from studio.streams.targets import OutputStatus, Target
from studio.streams.unity import UnityPose, unity_pose
from studio.streams.vmc import VmcEncoder

_log = logging.getLogger(__name__)

MAX_WAITING = 30
"""Maximum number of frames that wait for a slow network; older ones are dropped and counted."""

ADULT_M = (1.75, 0.93)
"""Height and hip height that are sent before a performer is known."""

EARLY = 0.25
"""Share of a period by which a frame may come early, so that a grid of another rate does not lose every other
frame."""


class Sender:
    """Sends the frames given to `add` to a target, from its own thread, until `close`."""

    def __init__(self, target: Target, cast: Cast) -> None:
        self.target = target
        self._cast = cast
        self._encode = _encoder(target)
        self._queue: deque[StepResult] = deque(maxlen=MAX_WAITING)
        self._wake = threading.Condition()
        self._closed = False
        self._due_ns: int | None = None
        self.sent = 0
        self.dropped = 0
        self.bytes = 0
        self.problem = ""
        self._thread = threading.Thread(target=self._run, name=f"output {target.id}", daemon=True)
        self._thread.start()

    def add(self, result: StepResult) -> None:
        """Queue a frame, unless it comes too early for the target's rate; never waits for the network."""
        period_ns = round(1e9 / self.target.rate_hz)
        now_ns = result.frame_set.stage_time_ns
        if (
            self._due_ns is not None
            and self._due_ns - 2 * period_ns < now_ns < self._due_ns - EARLY * period_ns
        ):
            return
        if self._due_ns is None or abs(now_ns - self._due_ns) > 2 * period_ns:
            self._due_ns = now_ns  # the first frame, or one after a pause
        self._due_ns += period_ns
        with self._wake:
            self.dropped += len(self._queue) == MAX_WAITING
            self._queue.append(result)
            self._wake.notify()

    def status(self) -> OutputStatus:
        """Return the target with what was sent, and the last error."""
        return OutputStatus(
            **structs.asdict(self.target),
            sent=self.sent,
            dropped=self.dropped,
            bytes=self.bytes,
            problem=self.problem,
        )

    def close(self) -> None:
        """Send waiting frames, then end; do not wait for a name server that does not answer."""
        with self._wake:
            self._closed = True
            self._wake.notify()
        self._thread.join(timeout=1.0)

    def _run(self) -> None:
        channel = Channel(self.target.host, self.target.port)
        while (result := self._next()) is not None:
            try:
                steps = steps_of(result, self._cast(), self.target.performer)
                for datagram in self._encode(steps) if steps else ():
                    channel.send(datagram)
                    self.bytes += len(datagram)
            except OSError as error:  # an unknown name, no route, a refused port: later frames may arrive
                self.problem = cannot_send(self.target.host, error)
            except Exception as error:  # boundary of the thread: the target reports it, the stage continues
                self.problem = f"the output failed: {error!r}"
                _log.exception("output %s failed", self.target.id)
            else:
                self.sent += bool(steps)
                self.problem = "" if steps else self._nobody()
        channel.close()

    def _nobody(self) -> str:
        return say(
            "output.nobody", "no performer on the stage is called {name!r} now", name=self.target.performer
        )

    def _next(self) -> StepResult | None:
        with self._wake:
            self._wake.wait_for(lambda: self._queue or self._closed)
            return self._queue.popleft() if self._queue else None


def _encoder(target: Target) -> Callable[[list[tuple[StepResult, Member]]], list[bytes]]:
    """Return the encoder of a frame's performers (at least one) to datagrams; VMC sends only the first."""
    scale = target.scale

    def pose_of(one: StepResult) -> UnityPose:
        return unity_pose(one.frame_set.stage_time_ns * 1e-9, one.positions_m, one.rotations_wxyz, scale)

    if target.kind == "vmc":
        vmc = VmcEncoder()
        return lambda steps: vmc.encode(pose_of(steps[0][0]), steps[0][0].timecode)
    rokoko = RokokoEncoder(target.rate_hz)

    def actor_of(one: StepResult, member: Member, several: bool) -> RokokoActor:
        known = member.proportions
        height, hips = ADULT_M if known is None else (known.height_m, float(known.offsets_m[0, 2]))
        name = member.name if several else target.actor
        return RokokoActor(name, pose_of(one), height * scale, hips * scale)

    return lambda steps: rokoko.encode(
        [actor_of(one, member, len(steps) > 1) for one, member in steps], steps[0][0].timecode
    )
