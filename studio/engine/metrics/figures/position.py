"""Distances between the joints of a solve and of a reference.

Source: mean per joint position error as in Ionescu et al., "Human3.6M", PAMI 2014, section 5.2, but with one
rigid alignment of the whole take instead of one per frame.
"""

import numpy as np

from studio.engine.metrics.reference.matching import Matched


def mpjpe_mm(matched: Matched) -> float:
    """Mean distance over the measured joints and all frames [mm]; every joint counts the same."""
    solve, reference = matched.pick(matched.joints)
    return float(np.nanmean(np.linalg.norm(solve - reference, axis=2), axis=0).mean() * 1e3)


def mpjpe_root_aligned_mm(matched: Matched) -> float | None:
    """Mean distance with the hips of both at the same place in every frame [mm]; None without hips."""
    if not matched.has("hips"):
        return None
    solve, reference = matched.pick(matched.joints)
    root_solve, root_reference = matched.pick(["hips"])
    difference = (solve - root_solve) - (reference - root_reference)
    return float(np.nanmean(np.linalg.norm(difference, axis=2), axis=0).mean() * 1e3)


def per_joint_mm(matched: Matched, names: list[str]) -> dict[str, float]:
    """Mean distance of each of these canonical joints [mm]."""
    solve, reference = matched.pick(names)
    means = np.nanmean(np.linalg.norm(solve - reference, axis=2), axis=0) * 1e3
    return {name: float(mean) for name, mean in zip(names, means, strict=True)}


def rms_mm(matched: Matched) -> float:
    """Root of the mean squared distance over the measured joints and all frames [mm]."""
    solve, reference = matched.pick(matched.joints)
    return float(np.sqrt(np.nanmean(((solve - reference) ** 2).sum(axis=2), axis=0).mean()) * 1e3)
