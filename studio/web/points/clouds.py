"""The thread that makes point clouds: of the newest depth, or of a replayed take at its playhead."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from studio.engine.model.frames import StepResult
from studio.web.points.maker import RATE_HZ, Maker, Step
from studio.web.points.replayed import ReplayedDepth
from studio.web.points.seen import READING, UNREADABLE, DepthImages
from studio.web.scene.clouds import Cloud
from studio.worker import Stopped

_log = logging.getLogger(__name__)

_WATCH_S = 0.5


@dataclass(frozen=True)
class CloudsStatus:
    """The points that are shown.

    Attributes:
        colour: one of `COLOURS`.
        cameras: those with depth, and whether each is shown.
        says: why a shown camera has no points: see `seen`.
        problem: of the whole take: `reading`, `unreadable` or nothing.
    """

    colour: str = "camera"
    cameras: dict[str, bool] = field(default_factory=dict)
    says: dict[str, str] = field(default_factory=dict)
    problem: str = ""


@dataclass(frozen=True)
class _Wanted:
    """The requested step, whether clouds are shown, their colour, and the hidden cameras."""

    step: Step
    shown: bool
    colour: str
    hidden: frozenset[str]


class PointClouds:
    """Makes clouds while they are wanted and a browser shows them. All methods may be called from any thread.

    Args:
        live: the live stage's images.
        watched: whether a browser is watching; changed: called on the thread when there are new clouds.
        clock: of the pace [s].
    """

    def __init__(
        self,
        live: DepthImages,
        *,
        watched: Callable[[], bool],
        changed: Callable[[], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._live = live
        self._watched = watched
        self._tell = changed
        self._clock = clock
        self._changed = threading.Condition()
        self._step = Step(None, None)
        self._shown = False
        self._colour = "camera"
        self._hidden: set[str] = set()
        self._clouds: dict[str, Cloud] = {}
        self._status = CloudsStatus()
        self._stopping = False
        self._maker = Maker()
        self._thread = threading.Thread(target=self._run, name="points", daemon=True)
        self._thread.start()

    def show(self, depth: ReplayedDepth | None, result: StepResult | None) -> None:
        """Make clouds for a step: of a replayed take, or of the live stage (None)."""
        with self._changed:
            self._step = Step(depth, result)
            if self._shown:
                self._changed.notify()

    def choose(
        self,
        *,
        shown: bool | None = None,
        colour: str | None = None,
        cameras: Mapping[str, bool] | None = None,
    ) -> None:
        """Show or hide all clouds or some cameras', or change their colour; None leaves a choice unchanged."""
        with self._changed:
            self._shown = self._shown if shown is None else shown
            self._colour = self._colour if colour is None else colour
            for name, on in (cameras or {}).items():
                (self._hidden.discard if on else self._hidden.add)(name)
            self._changed.notify()

    @property
    def newest(self) -> dict[str, Cloud]:
        """The newest clouds by camera."""
        with self._changed:
            return self._clouds

    def status(self) -> CloudsStatus:
        """Return the points that are shown."""
        with self._changed:
            cameras = {name: name not in self._hidden for name in self._status.cameras}
            return CloudsStatus(self._colour, cameras, self._status.says, self._status.problem)

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._stopping = True
            self._changed.notify()
        self._thread.join(timeout=5.0)

    def _run(self) -> None:
        problem, made = "", None
        while (wanted := self._wait(made)) is not None:
            begun_s = self._clock()
            try:
                self._make(wanted)
            except Stopped:
                _log.debug("the take is no longer wanted")
            except Exception as error:  # clouds must not end because one could not be made
                if repr(error) != problem:
                    _log.exception("the point clouds could not be made")
                problem = repr(error)
                self._publish({}, CloudsStatus(problem=UNREADABLE))
            made = wanted
            self._pause(begun_s + 1.0 / RATE_HZ - self._clock())
        self._maker.close()

    def _wait(self, made: _Wanted | None) -> _Wanted | None:
        """Return the request once it is new, or at once for the live stage; None at the end."""
        with self._changed:
            while not self._stopping:
                wanted = _Wanted(self._step, self._shown, self._colour, frozenset(self._hidden))
                if not wanted.shown:
                    if made is None or made.shown:
                        return wanted
                elif self._watched() and (wanted != made or wanted.step.depth is None):
                    return wanted
                self._changed.wait(_WATCH_S)
            return None

    def _pause(self, seconds: float) -> None:
        """Wait this long, or until the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._stopping, timeout=max(0.0, seconds))

    def _make(self, wanted: _Wanted) -> None:
        """Make the clouds, or none if they are not shown."""
        step, images = wanted.step, self._live
        if not wanted.shown:
            self._publish({}, CloudsStatus())
            return
        if step.depth is not None:
            if not self._maker.has(step.depth):
                self._publish({}, CloudsStatus(problem=READING))
            opened = self._maker.open(step.depth, lambda: not self._still(step.depth))
            if opened is None:
                self._publish({}, CloudsStatus(problem=UNREADABLE))
                return
            images = opened
        shown = [name for name in images.cameras if name not in wanted.hidden]
        clouds, says = self._maker.make(images, shown, step, wanted.colour)
        self._publish(clouds, CloudsStatus(cameras=dict.fromkeys(images.cameras, True), says=says))

    def _still(self, depth: ReplayedDepth | None) -> bool:
        """Whether a take's clouds are still wanted."""
        return self._shown and not self._stopping and self._step.depth is depth

    def _publish(self, clouds: dict[str, Cloud], status: CloudsStatus) -> None:
        with self._changed:
            same = clouds.keys() == self._clouds.keys() and all(
                clouds[name] is self._clouds[name] for name in clouds
            )
            self._clouds, self._status = clouds, status
        if not same:
            self._tell()
