"""Several performers of a take on one clock: their files, or their common scene, start and end together."""

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.poses import Poses

_NO_IDENTIFIER = re.compile(r"[^A-Za-z0-9_]+")


def on_one_clock(performers: Sequence[Poses]) -> list[Poses]:
    """Return performers' poses, all from the earliest first frame to the latest last frame.

    Before a performer's first frame and after their last one, that frame's pose is held with confidence 0.
    """
    begins_s = min(poses.begins_s for poses in performers)
    ends_s = max(float(poses.time_s[-1]) for poses in performers)
    return [_from_to(poses, begins_s, ends_s) for poses in performers]


def _from_to(poses: Poses, begins_s: float, ends_s: float) -> Poses:
    step_s = 1.0 / poses.frames_per_second
    before = round((poses.begins_s - begins_s) / step_s)
    after = round((ends_s - float(poses.time_s[-1])) / step_s)
    if before == after == 0:
        return poses

    def held(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([values[:1].repeat(before, 0), values, values[-1:].repeat(after, 0)])

    steps = np.concatenate([np.arange(-before, 0), np.zeros(poses.frame_count), np.arange(1, after + 1)])
    confidence = held(poses.confidence)
    confidence[:before] = 0.0
    confidence[len(confidence) - after :] = 0.0
    return replace(
        poses,
        time_s=held(poses.time_s) + steps * step_s,
        positions_m=held(poses.positions_m),
        rotations_wxyz=held(poses.rotations_wxyz),
        confidence=confidence,
        uncertainty_mm=held(poses.uncertainty_mm),
    )


def identifiers(names: Sequence[str]) -> list[str]:
    """Return unique names of letters, digits and `_`, which every program accepts as namespaces."""
    found: list[str] = []
    for name in names:
        plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
        base = _NO_IDENTIFIER.sub("_", plain).strip("_") or "performer"
        base = f"_{base}" if base[0].isdigit() else base
        chosen, number = base, 2
        while chosen in found:
            chosen, number = f"{base}_{number}", number + 1
        found.append(chosen)
    return found
