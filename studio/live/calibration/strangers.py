"""Strangers on the stage become performers: whoever holds a T-pose is measured, at any time and several at once.

Where everybody is to be a performer, strangers without a T-pose are measured as they move, once a camera has shown
them for `LEAST_SPAN_S`.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import StudioError
from studio.engine.calibration.performer.tpose import tpose_problems
from studio.engine.identity.recognised import LEAST_FRAMES, LEAST_SPAN_S, Recognised
from studio.engine.model.calibration import Calibration, Performer
from studio.engine.model.frames import CameraFrame
from studio.worker import run_in_process

_log = logging.getLogger(__name__)

HOLD_S = 1.3
"""Time for which strangers must hold out their arms, because nobody counts down for them [s]."""

_LOOK_S = 0.5
_KEPT_S = 4.0
_UP = np.array([0.0, 0.0, 1.0])

Report = Callable[[int, Performer | None], None]


class _Stranger:
    """What was seen of one stranger in the last seconds.

    Attributes:
        problems: what keeps them from being measured, in words for them.
        computing: a worker measures them.
    """

    def __init__(self) -> None:
        self.problems: list[str] = []
        self.computing = False
        self._joints: deque[tuple[int, NDArray[np.float64]]] = deque()
        self._frames: deque[tuple[int, CameraFrame]] = deque()
        self._good_since_ns: int | None = None
        self._tried_ns = 0

    def add(self, frame: CameraFrame, now_ns: int) -> None:
        """Keep a camera's frame."""
        self._frames.append((now_ns, frame))
        while now_ns - self._frames[0][0] > _KEPT_S * 1e9:
            self._frames.popleft()

    def holds(self, stage_time_ns: int, positions: NDArray[np.float64]) -> bool:
        """Whether they have held out their arms for long enough, up to these joints [m], shape (21, 3)."""
        self._joints.append((stage_time_ns, positions))
        while stage_time_ns - self._joints[0][0] > _LOOK_S * 1e9:
            self._joints.popleft()
        span_s = (stage_time_ns - self._joints[0][0]) * 1e-9
        if span_s < 0.8 * _LOOK_S:
            return False
        joints = np.stack([joints for _, joints in self._joints])
        self.problems = tpose_problems(joints, _UP, (len(joints) - 1) / span_s, still=False)
        if self.problems:
            self._good_since_ns = None
        elif self._good_since_ns is None:
            self._good_since_ns = self._joints[0][0]
        good_ns = stage_time_ns if self._good_since_ns is None else self._good_since_ns
        return not self.computing and stage_time_ns - good_ns >= HOLD_S * 1e9

    def is_seen(self) -> bool:
        """Whether a camera has shown them for long enough, since the last try, to measure them as they move."""
        if self.computing or not self._frames or self._frames[-1][0] - self._tried_ns < LEAST_SPAN_S * 1e9:
            return False
        times_ns: dict[str, list[int]] = {}
        for now_ns, frame in self._frames:
            times_ns.setdefault(frame.camera, []).append(now_ns)
        return any(
            len(own) >= LEAST_FRAMES and own[-1] - own[0] >= LEAST_SPAN_S * 1e9 for own in times_ns.values()
        )

    def frames(self) -> dict[str, list[CameraFrame]]:
        """Return the frames of the last seconds, by camera."""
        out: dict[str, list[CameraFrame]] = {}
        for _, frame in self._frames:
            out.setdefault(frame.camera, []).append(frame)
        return out

    def again(self) -> None:
        """Begin again: they held no T-pose, or too little was seen."""
        self.computing, self._good_since_ns = False, None
        self._tried_ns = self._frames[-1][0] if self._frames else self._tried_ns


class Strangers:
    """Watches everybody without proportions; its methods belong to the engine thread.

    A worker thread calls `report` with the index of a person and their measured proportions, if any.
    """

    def __init__(self, report: Report) -> None:
        self._report = report
        self._people: dict[int, _Stranger] = {}

    def forget(self) -> None:
        """Begin again: persons have other indices now."""
        self._people = {}

    def add(self, recognised: list[Recognised], now_ns: int) -> None:
        """Add the recognised bodies of a frame."""
        for one in recognised:
            if one.performer is None:
                self._people.setdefault(one.person, _Stranger()).add(one.frame, now_ns)

    def update(
        self,
        stage_time_ns: int,
        joints: Mapping[int, NDArray[np.float64]],
        clocked: Callable[[], Calibration | None],
        *,
        everybody: bool = False,
    ) -> None:
        """Check the strangers who are present, and start due measurements.

        Args:
            stage_time_ns: now.
            joints: of each in the stage frame [m], shape (21, 3), by index of person.
            clocked: returns the calibration with the cameras' present clocks.
            everybody: measure them without a T-pose too.
        """
        self._people = {
            person: one for person, one in self._people.items() if person in joints or one.computing
        }
        for person, one in self._people.items():
            if person not in joints:
                continue
            holds = one.holds(stage_time_ns, joints[person])
            if holds or (everybody and one.is_seen()):
                calibration = clocked()
                if calibration is not None:
                    one.computing = True
                    arguments = (self._people, person, calibration, one.frames(), not holds)
                    threading.Thread(
                        target=self._compute, args=arguments, name="stranger", daemon=True
                    ).start()

    def problems(self) -> list[list[str]]:
        """Return for each stranger what keeps them from being measured."""
        return [one.problems for _, one in sorted(self._people.items())]

    def finish(self, person: int, performer: Performer | None) -> None:
        """Handle a measurement; None = it gave no proportions."""
        if performer is not None:
            self._people.pop(person, None)
        elif person in self._people:
            self._people[person].again()

    def _compute(
        self,
        people: dict[int, _Stranger],
        person: int,
        calibration: Calibration,
        frames: dict[str, list[CameraFrame]],
        moves: bool,
    ) -> None:
        performer = None
        try:
            performer = run_in_process(
                "studio.live.calibration.tpose:measure_performer", calibration, frames, moves
            )
        except StudioError as error:
            _log.warning("a stranger could not be measured: %s", error)
        except Exception:  # the boundary of the thread
            _log.exception("measuring a stranger failed")
        if person in people:
            self._report(person, performer)
