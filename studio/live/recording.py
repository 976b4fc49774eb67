"""One recording of the live stage: the recorder, the live poses, and what is saved when it ends."""

from dataclasses import replace
from typing import Any

import numpy as np

from studio.engine.calibration.result import Calibration
from studio.engine.frames import FrameSet, FusedSkeleton, StepResult
from studio.engine.joints import JOINT_COUNT
from studio.engine.settings import SolveSettings
from studio.engine.solve.take import collect_poses
from studio.live.recorder import Recorder
from studio.take.solves import write_solve

LIVE_SOLVE = "live"

_NO_JOINTS = np.empty((0, JOINT_COUNT, 3))
_NO_CONFIDENCE = np.empty((0, JOINT_COUNT))
_NO_POSITIONS = np.empty((0, 3))
_NOT_KEPT = FusedSkeleton(
    np.full((JOINT_COUNT, 3), np.nan),
    np.zeros(JOINT_COUNT),
    np.full(JOINT_COUNT, np.nan),
    np.empty((0, JOINT_COUNT), dtype=bool),
)


class Recording:
    """What the engine thread keeps of a recording under way; `save` runs on another thread."""

    def __init__(self, recorder: Recorder, began_ns: int) -> None:
        self.recorder = recorder
        self.began_ns = began_ns
        self._results: list[StepResult] = []
        self._ended_ns = began_ns
        self._settings: SolveSettings | None = None
        self._calibration: Calibration | None = None

    @property
    def name(self) -> str:
        """`<session>/<take>`."""
        return str(self.recorder.take.meta["id"])

    def add(self, result: StepResult) -> None:
        """Keep a live pose, without the frames and the skeleton that it came from."""
        time_ns = result.frame_set.stage_time_ns
        empty = FrameSet(time_ns, (), _NO_JOINTS, _NO_CONFIDENCE, _NO_POSITIONS)
        self._results.append(replace(result, frame_set=empty, fused=_NOT_KEPT))

    def end(self, now_ns: int, settings: SolveSettings, calibration: Calibration | None) -> None:
        """Note how the recording ended; `calibration` has the final clocks."""
        self._ended_ns, self._settings, self._calibration = now_ns, settings, calibration

    def save(self) -> dict[str, Any]:
        """Finish `raw.mcap`, write the live solve and the final calibration; return a summary as JSON.

        Raises:
            StudioError: the disk does not take it; what was written before stays.
        """
        self.recorder.close()
        take = self.recorder.take
        if self._calibration is not None:
            take.add_calibration(self._calibration, use=True)
        if self._results:
            assert self._settings is not None
            poses = collect_poses(self._results)
            metrics = {"frames": poses.frame_count, "camera_frames": self.recorder.frames}
            write_solve(take, LIVE_SOLVE, settings=self._settings, poses=poses, metrics=metrics)
        return {
            "session": take.meta["session"],
            "take": take.meta["name"],
            "seconds": round((self._ended_ns - self.began_ns) * 1e-9, 3),
            "frames": self.recorder.frames,
            "poses": len(self._results),
            "problem": self.recorder.problem,
        }
