"""Residuals of a solve: joints that every camera reports far from the pose.

A human pose cannot follow everything: a second person's skeleton, an outlier, a limb bent beyond its range. These
figures show per joint where the pose is not the measurement.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import FrameSet, StepResult
from studio.engine.model.joints import CANONICAL, JOINT_COUNT, MIRROR, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.solve_metrics import SolveMetrics
from studio.engine.model.triangulation.rays import nearest_on_rays

NOT_FOLLOWED_M = 0.15
"""A joint further than this from every camera's report is not followed."""

TOLD_S = 0.2
TOLD_SHARE = 0.2
"""A stretch shorter than the first is a rejected spike and not reported, unless spikes fill the second share of the
frames, as with a second person now and then.
"""

JUMP_M_S = 12.0
"""Hips that move faster than this between frames belong to another person."""

NAMED = 4
"""Number of joints named in a line; the rest are counted."""


def distances_m(frames: FrameSet, positions_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance of each canonical joint to the nearest camera's report [m], shape (21,); NaN = unseen. A
    camera that exchanges left and right counts with the other side. A camera without depth reports rays.

    Args:
        frames: the cameras' reports.
        positions_m: the pose's output joints, shape (52, 3).
    """
    joints = positions_m[OUTPUT_OF_CANONICAL_INDEX]
    seen, mirrored = frames.positions, frames.positions[:, MIRROR]
    if frames.rays.any():
        seen, mirrored = seen.copy(), mirrored.copy()
        for reports in (seen, mirrored):
            reports[frames.rays] = nearest_on_rays(
                reports[frames.rays], frames.camera_positions[frames.rays], joints
            )
    apart, exchanged = seen - joints, mirrored - joints
    squared = np.fmin(np.vecdot(apart, apart), np.vecdot(exchanged, exchanged))
    squared = np.where(np.isnan(frames.positions[:, :, 0]), np.nan, squared)
    return np.sqrt(np.fmin.reduce(squared, axis=0, initial=np.nan))


def not_followed_mm(result: StepResult) -> dict[str, int]:
    """Return the joints that a frame's pose does not follow, with their distances [mm], the furthest first."""
    distance = distances_m(result.frame_set, result.positions_m)
    far = {
        name: round(1e3 * float(d)) for name, d in zip(CANONICAL, distance, strict=True) if d > NOT_FOLLOWED_M
    }
    return dict(sorted(far.items(), key=lambda item: -item[1]))


@dataclass(frozen=True)
class JointResidual:
    """Residual of one joint over a take.

    Attributes:
        share: frames in which it was not followed, as a share of those in which a camera reported it.
        longest_s: the longest stretch in which it was not followed.
        largest_mm: largest distance to the nearest report in these stretches; 0 where it was always followed.
        unseen_share: share of all frames in which no camera reported it.
    """

    share: float
    longest_s: float
    largest_mm: float
    unseen_share: float


class SolveResiduals:
    """Counts the joints that were not followed over a take; `add` each result in time order."""

    def __init__(self) -> None:
        self._frames = 0
        self._reported = np.zeros(JOINT_COUNT)
        self._off = np.zeros(JOINT_COUNT)
        self._largest_m = np.zeros(JOINT_COUNT)
        self._off_s, self._longest_s = np.zeros(JOINT_COUNT), np.zeros(JOINT_COUNT)
        self._nobody_s = self._longest_nobody_s = 0.0
        self._jumps = 0
        self._last_hips: NDArray[np.float64] | None = None
        self._last_ns: int | None = None

    def add(self, result: StepResult) -> None:
        """Count a frame."""
        now = result.frame_set.stage_time_ns
        dt = 0.0 if self._last_ns is None else max(now - self._last_ns, 0) * 1e-9
        self._last_ns = now
        distance = distances_m(result.frame_set, result.positions_m)
        off = distance > NOT_FOLLOWED_M  # False where unseen
        reported = ~np.isnan(distance)
        self._frames += 1
        self._reported += reported
        self._off += off
        self._largest_m = np.where(off, np.fmax(self._largest_m, distance), self._largest_m)
        self._off_s = np.where(off, self._off_s + dt, 0.0)
        self._longest_s = np.maximum(self._longest_s, self._off_s)
        self._nobody_s = 0.0 if reported.any() else self._nobody_s + dt
        self._longest_nobody_s = max(self._longest_nobody_s, self._nobody_s)
        self._jumps += self._jumped(result.positions_m[0], dt)

    def _jumped(self, hips: NDArray[np.float64], dt: float) -> bool:
        last, self._last_hips = self._last_hips, hips
        return last is not None and float(np.linalg.norm(hips - last)) > JUMP_M_S * max(dt, 1e-3)

    def joints(self) -> dict[str, JointResidual]:
        """Return the residual of each canonical joint."""
        frames = max(self._frames, 1)
        return {
            name: JointResidual(
                share=float(self._off[j] / max(self._reported[j], 1.0)),
                longest_s=float(self._longest_s[j]),
                largest_mm=1e3 * float(self._largest_m[j]),
                unseen_share=float(1.0 - self._reported[j] / frames),
            )
            for j, name in enumerate(CANONICAL)
        }

    def figures(self) -> SolveMetrics:
        """Return the residuals in `metrics.json`: `followed` to `not_followed`."""
        return {
            "followed": self.line(),
            "longest_without_anybody_s": round(self._longest_nobody_s, 3),
            "jumps": self._jumps,
            "not_followed": {
                name: {key: round(value, 4) for key, value in vars(joint).items()}
                for name, joint in self.joints().items()
            },
        }

    def line(self) -> str:
        """Return one line: joints not followed for `TOLD_S` or longer or as often as `TOLD_SHARE`, joints never seen,
        and jumps."""
        joints = self.joints()
        off = {
            name: joint
            for name, joint in joints.items()
            if joint.longest_s >= TOLD_S or joint.share >= TOLD_SHARE
        }
        worst = sorted(off, key=lambda name: -off[name].longest_s)
        told = [
            f"{name} {100 * off[name].share:.1f} % of the time ({off[name].longest_s:.1f} s at a stretch, "
            f"up to {off[name].largest_mm:.0f} mm off)"
            for name in worst[:NAMED]
        ]
        parts = ["could not follow " + _listed(told, len(worst))] if told else []
        unseen = [name for name, joint in joints.items() if joint.unseen_share == 1.0]
        parts += [f"never saw {_listed(unseen[:NAMED], len(unseen))}"] if unseen else []
        if self._longest_nobody_s >= TOLD_S:
            parts.append(f"saw nobody for up to {self._longest_nobody_s:.1f} s")
        if self._jumps:
            times = "once" if self._jumps == 1 else f"{self._jumps} times"
            parts.append(f"jumped to somebody elsewhere {times}")
        return "; ".join(parts) or "all joints"


def _listed(names: list[str], count: int) -> str:
    return ", ".join(names) + (f" and {count - len(names)} more" if count > len(names) else "")
