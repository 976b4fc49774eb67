"""The depth images of a replayed take at an instant."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.calibration import Calibration
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.model.frames import ClockModel
from studio.take.raw.depth import DepthReader, DepthRecording
from studio.web.points.seen import DAMAGED, NO_IMAGE, NO_PLACE, DepthSeen

NEAR_S = 0.05
"""Maximum distance between an instant and its image [s]; at 15 images a second with none lost, there is one."""

Placed = dict[str, tuple[NDArray[np.float64], ClockModel]]
"""By camera: 4x4, camera points to stage points [m], and its clock."""


@dataclass(frozen=True, eq=False)
class ReplayedDepth:
    """The file of a take's depth images, and its cameras' places; nothing is read yet."""

    raw_path: Path
    placed: Placed = field(default_factory=dict)

    @classmethod
    def of(cls, raw_path: Path, calibration: Calibration | None) -> "ReplayedDepth":
        """Return the depth of a take with its cameras placed by its calibration."""
        cameras = {} if calibration is None else calibration.cameras
        return cls(raw_path, {name: (one.T_stage_camera, one.clock) for name, one in cameras.items()})


NO_DEPTH = ReplayedDepth(Path())
"""Value where there is no take."""


class TakeDepth:
    """A take's depth images, read by its index; see `DepthImages`."""

    def __init__(self, recording: DepthRecording, placed: Placed) -> None:
        """Open the file.

        Raises:
            TakeError: the file cannot be opened.
        """
        self._recording = recording
        self._reader = DepthReader(recording)
        self._placed = placed
        self._times_s = {
            name: placed[name][1].stage_s(recording.times_ns(name).astype(np.float64) * 1e-9)
            for name in recording.cameras
            if name in placed
        }
        self._last: dict[str, tuple[int, DepthFrame | None]] = {}

    @property
    def cameras(self) -> tuple[str, ...]:
        return tuple(self._recording.cameras)

    def at(self, name: str, time_s: float) -> DepthSeen | str:
        if name not in self._times_s:
            return NO_PLACE
        times_s = self._times_s[name]
        after = min(int(np.searchsorted(times_s, time_s)), len(times_s) - 1)
        before = max(after - 1, 0)
        number = before if time_s - times_s[before] < times_s[after] - time_s else after
        if abs(times_s[number] - time_s) > NEAR_S:
            return NO_IMAGE
        if self._last.get(name, (-1, None))[0] != number:
            self._last[name] = number, self._reader.image(name, number)
        frame = self._last[name][1]
        if frame is None:
            return DAMAGED
        return DepthSeen(number, self._recording.cameras[name], frame.depth_mm, self._placed[name][0])

    def close(self) -> None:
        self._reader.close()
