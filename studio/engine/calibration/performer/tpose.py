"""A held T-pose: arms out sideways, straight and still, anywhere in the calibration part."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import unit
from studio.engine.base.sentences import say
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.model.joints import INDEX

_MIN_HOLD_S = 1.0
_MAX_SLOPE = np.sin(np.radians(25.0))
_MIN_STRAIGHT = np.cos(np.radians(35.0))
_MIN_OUTWARD = 0.85
_MAX_SPEED_M_S = 0.25
_SPEED_OVER_S = 0.5
_SHARE = 0.8
ACROSS_BODY = ("shoulder", "hip")
ACROSS_TPOSE = ("shoulder", "elbow", "wrist")


@dataclass(frozen=True)
class Hold:
    """A held pose: the instants from `first` to before `end` of the walk."""

    first: int
    end: int

    @property
    def frames(self) -> slice:
        return slice(self.first, self.end)


def find_tpose(walk: Walk, up: NDArray[np.float64]) -> Hold | None:
    """Return the longest T-pose held for at least a second, or None.

    Args:
        walk: the calibration part in any one frame.
        up: unit vector in that frame, shape (3,).
    """
    if len(walk.times_s) < 3:
        return None
    good = _is_tpose(walk.smooth(over_s=1.0), up, 1.0 / float(np.median(np.diff(walk.times_s))))
    half = min(round(0.25 / float(np.median(np.diff(walk.times_s)))), (len(good) - 1) // 2)
    window = np.ones(2 * half + 1)
    mostly = np.convolve(good, window, mode="same") >= _SHARE * np.convolve(
        np.ones(len(good)), window, mode="same"
    )
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mostly.astype(int), [0]])))
    runs = [(first, end) for first, end in edges.reshape(-1, 2)]
    if not runs:
        return None
    first, end = max(runs, key=lambda run: run[1] - run[0])
    if walk.times_s[end - 1] - walk.times_s[first] < _MIN_HOLD_S:
        return None
    return Hold(int(first), int(end))


@dataclass(frozen=True)
class _Arm:
    """One arm over some instants, each of shape (instant_count,); NaN = unseen.

    Attributes:
        slope: sine of the angle to the floor, up positive.
        straight: cosine of the bend at the elbow.
        outward: cosine of the angle to the line across the shoulders.
        speed_m_s: of the wrist.
    """

    slope: NDArray[np.float64]
    straight: NDArray[np.float64]
    outward: NDArray[np.float64]
    speed_m_s: NDArray[np.float64]

    def good(self) -> NDArray[np.bool_]:
        return (
            (np.abs(self.slope) < _MAX_SLOPE)
            & (self.straight > _MIN_STRAIGHT)
            & (self.outward > _MIN_OUTWARD)
            & (self.speed_m_s < _MAX_SPEED_M_S)
        )


def _is_tpose(joints: NDArray[np.float64], up: NDArray[np.float64], rate_hz: float) -> NDArray[np.bool_]:
    """Return whether each instant's joints, shape (instant_count, 21, 3), form a still T-pose."""
    return np.logical_and.reduce([arm.good() for arm in _arms(joints, up, rate_hz).values()])


def tpose_problems(
    joints: NDArray[np.float64], up: NDArray[np.float64], rate_hz: float, *, still: bool = True
) -> list[str]:
    """Return the faults of a T-pose that is being held, in words for the performer; empty = none.

    Args:
        joints: the last instants, half a second or more, in any one frame [m], shape (instant_count, 21, 3).
        up: unit vector in that frame, shape (3,).
        rate_hz: instants per second.
        still: arms that move are a fault.
    """
    problems = []
    for name, arm in _arms(joints, up, rate_hz).items():
        side = say("tpose.left", "left") if name == "left" else say("tpose.right", "right")
        slope, straight, outward = (_percentile(v, 50) for v in (arm.slope, arm.straight, arm.outward))
        speed = _percentile(arm.speed_m_s, 80)
        if np.isnan([slope, straight, outward]).any():
            problems.append(say("tpose.unseen", "{side} arm not seen", side=side))
        elif straight <= _MIN_STRAIGHT:
            problems.append(
                say(
                    "tpose.bent",
                    "{side} arm bent by {degrees:.0f} degrees: straighten it",
                    side=side,
                    degrees=np.degrees(np.arccos(max(straight, -1.0))),
                )
            )
        elif abs(slope) >= _MAX_SLOPE:
            high = say("tpose.high", "{side} arm too high: hold it level", side=side)
            low = say("tpose.low", "{side} arm too low: hold it level", side=side)
            problems.append(high if slope > 0 else low)
        elif outward <= _MIN_OUTWARD:
            problems.append(
                say(
                    "tpose.turned",
                    "{side} arm not out sideways, or the shoulders are turned: arms in one line",
                    side=side,
                )
            )
        if still and speed >= _MAX_SPEED_M_S:
            problems.append(
                say("tpose.moves", "{side} arm moves at {speed:.1f} m/s: hold still", side=side, speed=speed)
            )
    return problems


def _percentile(values: NDArray[np.float64], percent: float) -> float:
    """Return a percentile of the finite values; NaN where there is none."""
    seen = values[np.isfinite(values)]
    return float(np.percentile(seen, percent)) if len(seen) else np.nan


def _arms(joints: NDArray[np.float64], up: NDArray[np.float64], rate_hz: float) -> dict[str, _Arm]:
    """Return both arms of joints, shape (instant_count, 21, 3)."""
    across = unit(joints[:, INDEX["left_shoulder"]] - joints[:, INDEX["right_shoulder"]])
    arms = {}
    for side, outward in (("left", across), ("right", -across)):
        shoulder, elbow, wrist = (
            joints[:, INDEX[f"{side}_{name}"]] for name in ("shoulder", "elbow", "wrist")
        )
        arm = unit(wrist - shoulder)
        half = max(round(_SPEED_OVER_S / 2 * rate_hz), 1)
        ends = np.pad(wrist, ((half, half), (0, 0)), mode="edge")
        speed = np.linalg.norm(ends[2 * half :] - ends[: -2 * half], axis=1) * rate_hz / (2 * half)
        straight = (unit(elbow - shoulder) * unit(wrist - elbow)).sum(axis=1)
        arms[side] = _Arm(arm @ up, straight, (arm * outward).sum(axis=1), speed)
    return arms


def facing(
    joints: NDArray[np.float64], up: NDArray[np.float64], names: tuple[str, ...]
) -> NDArray[np.float64] | None:
    """Return the facing direction of a body over some instants, a unit vector; None where it was not seen.

    The line from right to left joints gives the direction except for its sign, which the toes decide (they point
    forwards whatever the labels are); without toes the labels decide.

    Args:
        joints: shape (instant_count, 21, 3), of one pose or a short time; NaN = unseen.
        up: unit vector, shape (3,).
        names: joints of both sides that lie across the body, such as `shoulder`; in a T-pose also the arms'.
    """
    lines = [joints[:, INDEX[f"left_{name}"]] - joints[:, INDEX[f"right_{name}"]] for name in names]
    medians = [
        np.median(x[np.isfinite(x).all(axis=1)], axis=0) for x in lines if np.isfinite(x).all(axis=1).any()
    ]
    if not medians:
        return None
    line = np.sum(medians, axis=0)  # long lines count for more, because they are more certain
    line = unit(line - (line @ up) * up)
    forward = np.cross(line, up)
    toes = np.concatenate(
        [joints[:, INDEX[f"{side}_toe"]] - joints[:, INDEX[f"{side}_ankle"]] for side in ("left", "right")]
    )
    toes = toes[np.isfinite(toes).all(axis=1)]
    exchanged = len(toes) > 0 and float(np.median(toes @ forward)) < 0
    return -forward if exchanged else forward
