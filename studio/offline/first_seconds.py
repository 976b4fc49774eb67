"""The beginning of a solve, shown while its take is still tracked: live-like, without finishing and physics."""

from dataclasses import replace

from studio.engine.model.calibration import Calibration, Performer
from studio.engine.model.frames import CameraFrame, StepResult
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.solve.stream import Stream
from studio.engine.whole_take.collect import collect_poses
from studio.offline.so_far import Show, SoFar

PART_S = 2.0
"""Length of the first part shown, and of each further one [s]."""


class FirstSeconds:
    """Solves tracked frames as they come, and shows parts of it.

    Args:
        calibration: as for the solve; its performer is not used.
        settings: those of the solve.
        span_ns: stage times of the first and the last frame of the solve.
        show: receives each part.
        most_parts: maximum number of parts; None = all.
    """

    def __init__(
        self,
        calibration: Calibration,
        settings: SolveSettings,
        span_ns: tuple[int, int],
        show: Show,
        *,
        most_parts: int | None = None,
    ) -> None:
        self._calibration = calibration
        self._settings = replace(settings, finish="off", physics="off")
        self._first_ns, self._last_ns = span_ns
        self._show = show
        self._left = most_parts
        self._waiting: list[CameraFrame] = []
        self._stream: Stream | None = None
        self._shown_ns: int | None = None
        self._begun_ns: int | None = None

    def take(self, frame: CameraFrame, performer: Performer) -> None:
        """Take in the next frame, with the performer as estimated so far."""
        now_ns = self._calibration.cameras[frame.camera].clock.stage_ns(frame.device_time_ns)
        if self._left == 0 or now_ns < self._first_ns:
            return
        if self._shown_ns is None and not self._waiting and now_ns > self._first_ns + PART_S * 1e9:
            self._left = 0  # there are no frames of the beginning
            return
        self._waiting.append(frame)
        if now_ns - (self._first_ns if self._shown_ns is None else self._shown_ns) < PART_S * 1e9:
            return
        if self._stream is None:
            self._stream = Stream(replace(self._calibration, performer=performer), self._settings)
        waiting, self._waiting = self._waiting, []
        results = [result for one in waiting for result in self._stream.add(one)]
        if results:
            self._tell(results, now_ns)

    def _tell(self, results: list[StepResult], now_ns: int) -> None:
        poses = collect_poses(results)
        begins = self._begun_ns is None
        if self._begun_ns is None:
            self._begun_ns = results[0].frame_set.stage_time_ns
        until_s = float(poses.time_s[-1]) - self._begun_ns * 1e-9
        self._shown_ns = now_ns
        self._left = None if self._left is None else self._left - 1
        self._show(SoFar(poses, begins, until_s, max((self._last_ns - self._begun_ns) * 1e-9, until_s)))
