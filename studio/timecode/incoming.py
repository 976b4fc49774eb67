"""Incoming timecode: listens to one source on a thread, and returns the timecode at a time."""

import logging
import threading
from collections import deque
from collections.abc import Callable

import numpy as np
from msgspec import Struct

from studio.engine.base.errors import StudioError
from studio.engine.base.sentences import say, system_says
from studio.engine.timecode.course import TimecodeCourse, course
from studio.engine.timecode.timecode import RATES, Timecode, TimecodeRate, rate_named
from studio.timecode.sources import TimecodeSource, open_source

OFF = "off"
_RECENT, _SLOW = 150, 600
"""Numbers of readings kept: the most recent ones, and one per second for the drift."""

_FRESH_NS, _SECOND_NS = 200_000_000, 1_000_000_000
_HEARD_NS = 1_000_000_000
_RETRY_S = 1.0
_log = logging.getLogger(__name__)


class TimecodeStatus(Struct, frozen=True):
    """State of the incoming timecode.

    Attributes:
        source: the chosen source, `off` = none; rate: name of the rate.
        state: `off`, `waiting` (nothing arrived yet), `running`, or `bridged` (lost; the clock continues it).
        timecode: current timecode, "" = unknown; drop-frame has `;` before the frames.
        drift_ppm: how much faster than the server's clock it runs; None = not known yet.
        problem: why it cannot be received, "" = no problem.
    """

    source: str = OFF
    rate: str = "25"
    state: str = OFF
    timecode: str = ""
    drift_ppm: float | None = None
    problem: str = ""


class IncomingTimecode:
    """Listens to the chosen source; thread-safe.

    Args:
        clock_ns: the server's clock [ns].

    Attributes:
        on_reading: called on the source's thread with the time on the server's clock [ns], the frame since midnight,
            the rate, and the source's name.
    """

    def __init__(self, clock_ns: Callable[[], int]) -> None:
        self._clock_ns = clock_ns
        self._lock = threading.Lock()
        self._choosing = threading.Lock()
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self._source: TimecodeSource | None = None
        self.chosen, self.rate = OFF, RATES["25"]
        self.on_reading: Callable[[int, int, TimecodeRate, str], None] = lambda *reading: None
        self._forget()

    def _forget(self) -> None:
        self._recent: deque[tuple[int, int]] = deque(maxlen=_RECENT)
        self._slow: deque[tuple[int, int]] = deque(maxlen=_SLOW)
        self._course: TimecodeCourse | None = None
        self._made_ns = 0
        self._drift: float | None = None
        self._drift_ns = 0
        self._problem = ""

    def choose(self, source: str, rate: str) -> None:
        """Listen to this source at this rate from now on; `off` listens to nothing.

        Raises:
            SettingsError: an unknown source or rate; the previous source stays in use.
        """
        of_rate = rate_named(rate)
        opened = None if source == OFF else open_source(source, of_rate)
        with self._choosing:
            self.close()
            with self._lock:
                self._forget()
                self.chosen, self.rate = source, of_rate
                self._stopping = threading.Event()
                self._thread, self._source = None, opened
                if opened is not None:
                    arguments = (opened, self._stopping)
                    self._thread = threading.Thread(
                        target=self._run, args=arguments, name="timecode", daemon=True
                    )
                    self._thread.start()

    def close(self) -> None:
        """Stop listening; wait at most 1 s for a device that does not answer."""
        self._stopping.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(timeout=1.0)

    def _run(self, source: TimecodeSource, stopping: threading.Event) -> None:
        def put(time_ns: int, frame: int) -> None:
            if not stopping.is_set():
                self._add(time_ns, frame)
                self.on_reading(time_ns, frame, self.rate, source.name)

        while not stopping.is_set():
            try:
                source.run(self._clock_ns, put, stopping)
                ended = say("timecode.ended", "the source has ended")
            except (OSError, ValueError) as error:
                reason = system_says(error) if isinstance(error, OSError) else error
                ended = say("timecode.not_opened", "{source}: {error}", source=self.chosen, error=reason)
            except StudioError as error:
                ended = error.sentence
            except Exception as error:  # boundary of the thread
                _log.exception("timecode failed")
                ended = say("timecode.not_opened", "{source}: {error}", source=self.chosen, error=repr(error))
            if not stopping.is_set():
                self._problem = ended
                stopping.wait(_RETRY_S)

    def _add(self, time_ns: int, frame: int) -> None:
        with self._lock:
            self._problem = ""
            self._recent.append((time_ns, frame))
            if not self._slow or abs(time_ns - self._slow[-1][0]) >= _SECOND_NS:
                self._slow.append((time_ns, frame))

    def at(self, time_ns: int) -> Timecode | None:
        """Return the timecode at a time on the server's clock [ns], near now; None if none has arrived."""
        with self._lock:
            path = self._path()
        if path is None or not path.runs:
            return None
        return path.timecodes_at(np.array([time_ns * 1e-9]))[0]

    def _why_not(self, source: TimecodeSource) -> str:
        """Return why the input of a source is rejected, "" = there is no input."""
        if source.backwards:
            return say("timecode.backwards", "the timecode runs backwards; it counts once it runs forwards")
        if not source.refused:
            return ""
        return say(
            "timecode.other_rate",
            "{n} timecodes of another rate than {rate} came; choose the rate of the sender",
            n=source.refused,
            rate=self.rate.name,
        )

    def _path(self) -> TimecodeCourse | None:
        now_ns = self._clock_ns()
        if self._recent and (self._course is None or now_ns - self._made_ns > _FRESH_NS):
            self._course, self._made_ns = course(_seconds(self._recent), self.rate), now_ns
        return self._course

    def status(self) -> TimecodeStatus:
        """Return the current state."""
        now_ns = self._clock_ns()
        now = self.at(now_ns)
        with self._lock:
            if now_ns - self._drift_ns > _SECOND_NS:
                told = course(_seconds(self._slow), self.rate).drift_ppm
                self._drift, self._drift_ns = None if told is None else round(told, 1), now_ns
            heard = bool(self._recent) and now_ns - self._recent[-1][0] < _HEARD_NS
            state = OFF if self.chosen == OFF else "waiting"
            problem = self._problem
            if self._source is not None and not heard and not problem:
                problem = self._why_not(self._source)
            if now is not None:
                state = "running" if heard else "bridged"
            return TimecodeStatus(
                self.chosen,
                self.rate.name,
                state,
                "" if now is None else str(now),
                self._drift,
                problem,
            )


def _seconds(readings: "deque[tuple[int, int]]") -> list[tuple[float, int]]:
    return [(time_ns * 1e-9, frame) for time_ns, frame in readings]
