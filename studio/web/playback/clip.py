"""A solve of a take, loaded for replay."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from studio.engine.base.errors import FormatError, StudioError
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import ClockModel, FrameSet, FusedSkeleton, StepResult
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.model.poses import Poses, on_output_joints
from studio.engine.model.spans import Span
from studio.engine.whole_take.trace import Trace
from studio.take.folder.solves import TRACE, solve_disagreements
from studio.take.folder.take import Take
from studio.web.points.replayed import NO_DEPTH, ReplayedDepth

_NOBODY = FusedSkeleton(
    np.full((JOINT_COUNT, 3), np.nan),
    np.zeros(JOINT_COUNT),
    np.full(JOINT_COUNT, np.nan),
    np.zeros((0, JOINT_COUNT), bool),
)


@dataclass(frozen=True)
class Clip:
    """A solve with its inputs.

    Attributes:
        take: its id, `session/name`.
        solve: its name.
        poses: of the output skeleton.
        trace: inputs of the frames; None for the solve `live` and imported ones.
        calibration: in use in the take, if it has one.
        disagrees: by camera, the spans in which it did not agree with the others; may be empty.
        holds: what the take holds, where there is no solve.
        depth: where the take's depth images are.
    """

    take: str
    solve: str
    poses: Poses
    trace: Trace | None
    calibration: Calibration | None
    disagrees: dict[str, list[Span]] = field(default_factory=dict)
    holds: dict[str, Any] | None = None
    depth: ReplayedDepth = NO_DEPTH

    @classmethod
    def load(cls, take: Take, solve: str) -> "Clip":
        """Return a take's solve.

        Raises:
            FormatError: the solve is empty, damaged, or an animation without hips.
        """
        folder = take.performer_folder(solve)
        poses = on_output_joints(Poses.load(folder / "poses.npz"))
        if poses.frame_count == 0:
            raise FormatError(
                "replay.no_frames", "solve {name!r} has no frames; solve the take again", name=solve
            )
        clip = cls.of(take, solve, poses)
        return replace(clip, trace=_trace(folder / TRACE, poses), disagrees=solve_disagreements(folder))

    @classmethod
    def of(cls, take: Take, solve: str, poses: Poses) -> Self:
        """Return poses as a take's solve, without what went into them."""
        calibration = _calibration(take)
        depth = ReplayedDepth.of(take.raw_path, calibration)
        return cls(f"{take.path.parent.name}/{take.path.name}", solve, poses, None, calibration, depth=depth)

    def clock(self, camera: str) -> ClockModel | None:
        """Return the map from a camera's clock to the stage clock; None where nothing tells it."""
        placed = self.depth.placed.get(camera)
        return None if placed is None else placed[1]

    def step(self, frame: int) -> StepResult:
        """Return a frame as a result of the pipeline."""
        poses = self.poses
        if self.trace is None:
            time_ns = round(float(poses.time_s[frame]) * 1e9)
            empty = np.zeros((0, JOINT_COUNT))
            frames = FrameSet(time_ns, (), np.zeros((0, JOINT_COUNT, 3)), empty, np.zeros((0, 3)))
            inputs = frames, _NOBODY
        else:
            inputs = self.trace.inputs(frame)
        return StepResult(
            *inputs,
            poses.positions_m[frame],
            poses.rotations_wxyz[frame],
            poses.confidence[frame],
            poses.uncertainty_mm[frame],
            root_height_m=poses.root_height_m,
        )

    def with_part(self, part: Poses) -> "Clip":
        """Return the clip with these poses, of the output skeleton, at their times; the frames' inputs do not
        change.
        """
        times = self.poses.time_s
        rows = np.flatnonzero((times >= part.time_s[0] - 1e-6) & (times <= part.time_s[-1] + 1e-6))
        after = np.clip(np.searchsorted(part.time_s, times[rows]), 1, max(part.frame_count - 1, 1))
        nearer = (times[rows] - part.time_s[after - 1]) < (part.time_s[after] - times[rows])
        of = after - nearer
        changed = {}
        for name in ("positions_m", "rotations_wxyz", "confidence", "uncertainty_mm"):
            changed[name] = getattr(self.poses, name).copy()
            changed[name][rows] = getattr(part, name)[of]
        return replace(self, poses=replace(self.poses, **changed))

    def nearest(self, time_s: float) -> int:
        """Return the frame nearest to a stage time [s]."""
        times = self.poses.time_s
        after = min(int(np.searchsorted(times, time_s)), len(times) - 1)
        before = max(after - 1, 0)
        return before if time_s - times[before] < times[after] - time_s else after


def _trace(path: Path, poses: Poses) -> Trace | None:
    """Return a solve's trace; None if there is none that fits."""
    if not path.is_file():
        return None
    try:
        trace = Trace.load(path)
    except FormatError:
        return None
    return trace if len(trace.time_ns) == poses.frame_count else None


def _calibration(take: Take) -> Calibration | None:
    try:
        return take.calibration()
    except StudioError:
        return None
