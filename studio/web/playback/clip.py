"""A solve of a take, loaded for replay."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.together import on_one_clock
from studio.engine.base.errors import FormatError, StudioError
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import ClockModel, FrameSet, FusedSkeleton, StepResult
from studio.engine.model.joints import JOINT_COUNT
from studio.engine.model.poses import Poses, on_output_joints
from studio.engine.model.spans import Span
from studio.engine.whole_take.trace import Trace
from studio.take.folder.performers import performer_by_name, performer_number
from studio.take.folder.solved import SolvedPerformer, solved_performers
from studio.take.folder.solves import TRACE, solve_disagreements
from studio.take.folder.take import Take
from studio.take.rigid_bodies.replayed import NO_BODIES, ReplayedBodies
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
        holds: the content of the take, if there is no solve.
        depth: where the take's depth images are.
        performer: which of several this is, `performer_1` and so on; "" for a single performer.
        names: of all performers of the solve, by performer; empty for a single performer.
        undecided_s: by performer the spans of stage time [s] in which they were not told apart from another.
        here: whether this performer is on the stage, shape (frame_count,); None = always.
        others: the clips of further performers, with the same frames.
        bodies: the rigid bodies and markers that another system tracked.
    """

    take: str
    solve: str
    poses: Poses
    trace: Trace | None
    calibration: Calibration | None
    disagrees: dict[str, list[Span]] = field(default_factory=dict)
    holds: dict[str, Any] | None = None
    depth: ReplayedDepth = NO_DEPTH
    performer: str = ""
    names: dict[str, str] = field(default_factory=dict)
    undecided_s: dict[str, tuple[tuple[float, float], ...]] = field(default_factory=dict)
    here: NDArray[np.bool_] | None = None
    others: "tuple[Clip, ...]" = ()
    bodies: ReplayedBodies = NO_BODIES

    @classmethod
    def load(cls, take: Take, solve: str, performer: str | None = None) -> "Clip":
        """Return a take's solve. With several performers, the clip is that of `performer`, else of the first; it has
        frames from the first frame of any to the last frame of any.

        Raises:
            TakeError: no such performer.
            FormatError: the solve is empty, damaged, or an animation without hips.
        """
        if performer is not None:
            take.performer_folder(solve, performer)  # reports a missing performer
        solved = solved_performers(take, solve)
        clip = cls.of(take, solve, _checked(solve, solved[0].poses), solved)
        if solved[0].undecided_s is None:
            folder = take.solve_folder(solve)
            trace = _trace(folder / TRACE, clip.poses)
            return replace(clip, trace=trace, disagrees=solve_disagreements(folder))
        own = [_checked(solve, one.poses) for one in solved]
        clips = [
            _of_one(clip, take.performer_folder(solve, one.performer), one, poses, common)
            for one, poses, common in zip(solved, own, on_one_clock(own), strict=True)
        ]
        names = {one.performer: one.name for one in solved}
        doubts = {one.performer: one.undecided_s or () for one in solved}
        first = replace(clips[0], names=names, undecided_s=doubts, others=tuple(clips[1:]))
        return first if performer is None else first.chosen(performer_by_name(take.meta, performer))

    @classmethod
    def of(cls, take: Take, solve: str, poses: Poses, performers: Sequence[SolvedPerformer] = ()) -> Self:
        """Return poses as a take's solve, without their inputs; its performers may hold props."""
        calibration = _calibration(take)
        depth = ReplayedDepth.of(take.raw_path, calibration)
        name = f"{take.path.parent.name}/{take.path.name}"
        bodies = ReplayedBodies.of(take, performers)
        return cls(name, solve, poses, None, calibration, depth=depth, bodies=bodies)

    def clock(self, camera: str) -> ClockModel | None:
        """Return the map from a camera's clock to the stage clock; None if unknown."""
        placed = self.depth.placed.get(camera)
        return None if placed is None else placed[1]

    def everybody(self) -> "tuple[Clip, ...]":
        """Return the clip of every performer."""
        return (self, *self.others)

    def chosen(self, performer: str) -> "Clip":
        """Return the clip with this performer as the one of the curves, if the solve has this performer."""
        for one in self.others:
            if one.performer == performer:
                others = tuple(other for other in self.everybody() if other is not one)
                return replace(
                    one, names=self.names, undecided_s=self.undecided_s,
                    others=tuple(replace(other, others=()) for other in others),
                )  # fmt: skip
        return self

    @property
    def number(self) -> int:
        """The performer's number, from 1."""
        return performer_number(self.performer) if self.performer else 1

    def is_here(self, frame: int) -> bool:
        """Whether the performer is on the stage in a frame."""
        return self.here is None or bool(self.here[frame])

    def step(self, frame: int) -> StepResult:
        """Return a frame as a result of the pipeline, with everybody who is on the stage."""
        found = [one._own_step(frame) for one in self.everybody() if one.is_here(frame)]
        if not found:
            nobody = self._own_step(frame)
            return replace(nobody, positions_m=np.full_like(nobody.positions_m, np.nan))
        time_s = float(self.poses.time_s[frame])
        bodies, markers = self.bodies.at(time_s), self.bodies.markers_at(time_s)
        return replace(found[0], others=tuple(found[1:]), bodies=bodies, markers=markers)

    def trails(self, frame: int, frames: int) -> dict[int, NDArray[np.float64]]:
        """Return the joints' places up to a frame by performer number, shape (N, 52, 3), N at most `frames`."""
        part, found = slice(max(0, frame - frames), frame + 1), {}
        for one in self.everybody():
            places = one.poses.positions_m[part] if self.solve else one.poses.positions_m[:0]
            found[one.number] = places if one.here is None or not self.solve else places[one.here[part]]
        return found

    def _own_step(self, frame: int) -> StepResult:
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
            performer=self.number,
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


def _checked(solve: str, poses: Poses) -> Poses:
    poses = on_output_joints(poses)
    if poses.frame_count == 0:
        raise FormatError(
            "replay.no_frames", "solve {name!r} has no frames; solve the take again", name=solve
        )
    return poses


def _of_one(clip: Clip, folder: Path, one: SolvedPerformer, own: Poses, common: Poses) -> Clip:
    """Return the clip of one of several performers, with the frames that all have."""
    begin = int(np.searchsorted(common.time_s, own.begins_s - 0.5 / own.frames_per_second))
    end = begin + own.frame_count
    here = np.zeros(common.frame_count, dtype=bool)
    here[begin:end] = True
    trace = _trace(folder / TRACE, own)
    if trace is not None:
        times_ns = np.rint(common.time_s * 1e9).astype(np.int64)
        trace = trace.padded(times_ns[:begin], times_ns[end:])
    return replace(
        clip,
        poses=common,
        trace=trace,
        disagrees=solve_disagreements(folder),
        performer=one.performer,
        here=here,
    )


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
