"""What a solve could not follow: joints that a camera reports far from where the pose has them.

A pose that stays human cannot go everywhere: a second person's skeleton, a joint thrown aside, a limb bent beyond
its range. That is said here, per joint, so that nobody takes such a pose for a measurement.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.frames import FrameSet, StepResult
from studio.engine.joints import CANONICAL, JOINT_COUNT, MIRROR, OUTPUT_OF_CANONICAL_INDEX

NOT_FOLLOWED_M = 0.15
"""A joint further than this from every camera's report of it is not followed."""

TOLD_S = 0.2
TOLD_SHARE = 0.2
"""Shorter than the first it is a spike left out, which is no more than right, unless it happens in this share of the
frames: a second person by turns."""

JUMP_M_S = 12.0
"""Hips that move faster than this from frame to frame are somebody else's, or a swap of persons."""

NAMED = 4
"""Joints that a line names; more are counted."""


def distances_m(frames: FrameSet, positions_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far each canonical joint is from the nearest camera's report of it [m], shape (21,); NaN = no camera
    reports it. A camera that takes left for right counts as reporting the other side.

    Args:
        frames: what the cameras reported.
        positions_m: the pose's output joints, shape (52, 3).
    """
    joints = positions_m[OUTPUT_OF_CANONICAL_INDEX]
    apart = frames.positions - joints
    exchanged = frames.positions[:, MIRROR] - joints
    squared = np.fmin(np.vecdot(apart, apart), np.vecdot(exchanged, exchanged))
    squared = np.where(np.isnan(frames.positions[:, :, 0]), np.nan, squared)
    return np.sqrt(np.fmin.reduce(squared, axis=0, initial=np.nan))


def not_followed_mm(result: StepResult) -> dict[str, int]:
    """Return the joints that a frame's pose does not follow, and how far off they are [mm], the furthest first."""
    distance = distances_m(result.frame_set, result.positions_m)
    far = {
        name: round(1e3 * float(d)) for name, d in zip(CANONICAL, distance, strict=True) if d > NOT_FOLLOWED_M
    }
    return dict(sorted(far.items(), key=lambda item: -item[1]))


@dataclass(frozen=True)
class JointFollowing:
    """How one joint was followed over a take.

    Attributes:
        share: of the frames in which a camera reported it, those in which it was not followed.
        longest_s: the longest time that it was not followed.
        largest_mm: the furthest that it then was from the nearest report; 0 where it was followed throughout.
        unseen_share: of all frames, those in which no camera reported it.
    """

    share: float
    longest_s: float
    largest_mm: float
    unseen_share: float


class Following:
    """Counts over a take what could not be followed; `add` each result in time order."""

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
        off = distance > NOT_FOLLOWED_M  # False where nobody reports it
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

    def joints(self) -> dict[str, JointFollowing]:
        """Return how each canonical joint was followed."""
        frames = max(self._frames, 1)
        return {
            name: JointFollowing(
                share=float(self._off[j] / max(self._reported[j], 1.0)),
                longest_s=float(self._longest_s[j]),
                largest_mm=1e3 * float(self._largest_m[j]),
                unseen_share=float(1.0 - self._reported[j] / frames),
            )
            for j, name in enumerate(CANONICAL)
        }

    def figures(self) -> dict[str, Any]:
        """Return what `metrics.json` holds: the line, the longest time without anybody, how often the pose jumped to
        another place, and each joint's figures."""
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
        """Return in one line what was not followed for `TOLD_S` or longer or as often as `TOLD_SHARE`, what was never
        seen, and jumps."""
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
