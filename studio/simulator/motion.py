"""A known motion on the stage: centred, on the floor, at 120 Hz, after the calibration part."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from studio.engine.animation.motion.authored import calibration_motion, demo_motion
from studio.engine.animation.motion.keys import RATE_HZ
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.animation.motion.proportions import TOE_HEIGHT_M
from studio.engine.animation.read.files import canonical_animation
from studio.engine.base.errors import FormatError
from studio.engine.model.joints import INDEX

DEMO = "demo"
"""The embedded performer's motion, which is not a file."""

_FEET = [INDEX[f"{side}_{joint}"] for side in ("left", "right") for joint in ("ankle", "toe")]


def stage_motion(
    path: str | Path, *, unit_m: float | None = None, calibration: bool = True
) -> tuple[CanonicalMotion, float | None]:
    """Return a motion on the stage at 120 Hz, after its calibration part, and that part's length [s].

    The path of the hips is centred over the stage's origin. The lower foot stands on the floor at its 2nd percentile.

    Raises:
        FormatError: see `canonical_animation`; or fewer than two frames are left.
    """
    embedded = str(path) == DEMO
    source = demo_motion() if embedded else canonical_animation(path, unit_m=unit_m)
    positions = source.positions_m[1 if has_rest_frame(path) else 0 :]
    if len(positions) < 2:
        raise FormatError(
            "simulator.few_frames",
            "{path} has {n} frames; two are needed, and a BVH's first one is dropped",
            path=path,
            n=source.frame_count,
        )
    return staged(replace(source, positions_m=positions), calibration=calibration)


def staged(source: CanonicalMotion, *, calibration: bool = True) -> tuple[CanonicalMotion, float | None]:
    """Return a joint motion placed on the stage; see `stage_motion`."""
    positions = source.positions_m
    hips = positions[:, INDEX["hips"], :2]
    floor = np.percentile(positions[:, _FEET, 2].min(axis=1), 2) - TOE_HEIGHT_M
    positions = positions - [*((hips.min(axis=0) + hips.max(axis=0)) / 2), floor]
    positions = _resample(positions, source.frame_s)
    calibration_s = None
    if calibration:
        before = calibration_motion(source.offsets_m)
        calibration_s = before.frame_count * before.frame_s
        positions = np.concatenate([before.positions_m, positions])
    hands = np.ones((len(positions), 2))
    return CanonicalMotion(1 / RATE_HZ, positions, source.offsets_m, hands), calibration_s


def has_rest_frame(path: str | Path) -> bool:
    """Whether the motion's first frame is a rest pose, as in a BVH."""
    return Path(path).suffix.lower() == ".bvh"


def _resample(positions: NDArray[np.float64], frame_s: float) -> NDArray[np.float64]:
    times = np.arange(len(positions)) * frame_s
    return CubicSpline(times, positions)(np.arange(int(times[-1] * RATE_HZ + 1e-6) + 1) / RATE_HZ)
