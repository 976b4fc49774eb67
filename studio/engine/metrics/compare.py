"""How far two solves of one take are apart, without a reference: where to look before deciding between them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import interp1d

from studio.engine.errors import FormatError
from studio.engine.joints import CANONICAL
from studio.engine.metrics.canonical import canonical_positions
from studio.engine.poses import Poses


def compare(a: Poses, b: Poses, *, worst: int = 10) -> dict[str, Any]:
    """Return the distances between two solves at their common instants.

    Args:
        a, b: solves in the same stage frame, on the same clock.
        worst: how many of the instants that differ most are listed, at least half a second apart.

    Returns:
        `frames`, `mean_mm`, `p95_mm`, `max_mm`, `per_joint_mm` (mean by canonical joint that both have), `worst`: a
        list of `time_s`, `joint`, `mm`.

    Raises:
        FormatError: no instant or no joint in common.
    """
    first, last = max(a.time_s[0], b.time_s[0]), min(a.time_s[-1], b.time_s[-1])
    inside = (a.time_s >= first - 1e-9) & (a.time_s <= last + 1e-9)
    if not inside.any():
        raise FormatError("the two solves have no instant in common; choose solves of one take")
    time_s = a.time_s[inside]
    here, there = canonical_positions(a)[inside], canonical_positions(b)
    joints = np.flatnonzero(np.isfinite(here).all(axis=(0, 2)) & np.isfinite(there).all(axis=(0, 2)))
    if len(joints) == 0:
        raise FormatError("the two solves have no joint in common; choose solves of one take")
    at = interp1d(b.time_s, there[:, joints], axis=0, assume_sorted=True, fill_value="extrapolate")(time_s)
    mm = np.linalg.norm(here[:, joints] - at, axis=2) * 1e3
    names = [CANONICAL[j] for j in joints]
    return {
        "frames": len(time_s),
        "mean_mm": float(mm.mean()),
        "p95_mm": float(np.percentile(mm, 95)),
        "max_mm": float(mm.max()),
        "per_joint_mm": {name: float(mm[:, j].mean()) for j, name in enumerate(names)},
        "worst": _worst(time_s, mm, names, worst),
    }


def _worst(
    time_s: NDArray[np.float64], mm: NDArray[np.float64], names: list[str], count: int
) -> list[dict[str, Any]]:
    """Return the instants at which a joint differs most, with the joint."""
    found: list[dict[str, Any]] = []
    for i in np.argsort(mm.max(axis=1))[::-1]:
        if len(found) == count:
            break
        if all(abs(time_s[i] - other["time_s"]) >= 0.5 for other in found):
            joint = int(mm[i].argmax())
            found.append({"time_s": float(time_s[i]), "joint": names[joint], "mm": float(mm[i, joint])})
    return found
