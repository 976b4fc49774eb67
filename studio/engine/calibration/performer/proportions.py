"""A performer's proportions: bone lengths, and joint positions in a T-pose.

Lengths are measured over the whole calibration part. Noise makes a bone appear too long (the mean of |d + n| is
more than |d|), so lengths come from products of two cameras' vectors of the same bone, whose noise is
independent (the mean of (d + n1).(d + n2) is |d|^2). With one camera the variance of the length is subtracted.
"""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import unit
from studio.engine.calibration.cameras.merge import Walk
from studio.engine.model.calibration import Performer
from studio.engine.model.human.anthropometry import ANKLE_HEIGHT, TOP_OF_HEAD, anthropometric_positions
from studio.engine.model.joints import INDEX, JOINT_COUNT, MIRROR, PARENTS

_CENTRE = ("spine", "chest", "neck", "head")
_TRUNK = (*_CENTRE, "left_shoulder", "right_shoulder", "left_hip", "right_hip")
_MIN_SAMPLES = 20
_SURE = 0.25
"""A joint counts as sure from this share of the usual weight; a hidden joint has a sixteenth of it."""


def measure(walk: Walk) -> Performer | None:
    """Return the performer of a walk in the stage frame (z up); None where too little of a body was seen.

    The trunk's joints are at their mean places in the trunk's own axes; arms and legs are straight lines of the
    measured lengths; both sides are the same. Joints that no camera reports are placed as on an average person
    of the same height.
    """
    lengths = bone_lengths(walk)
    trunk = _symmetric(_trunk_positions(walk))
    height = _height(trunk, lengths, walk)
    if height is None:
        return None
    usual = anthropometric_positions(height)
    usual_offsets = usual - usual[np.maximum(PARENTS, 0)]
    positions = np.zeros((JOINT_COUNT, 3))
    for name in _TRUNK:
        j = INDEX[name]
        positions[j] = trunk[j] if np.isfinite(trunk[j]).all() else _between(name, trunk, usual)
    offsets = positions - positions[np.maximum(PARENTS, 0)]
    for name in ("elbow", "wrist", "hand", "knee", "ankle", "toe"):
        for side in ("left", "right"):
            j = INDEX[f"{side}_{name}"]
            way = usual_offsets[j] / np.linalg.norm(usual_offsets[j])
            offsets[j] = usual_offsets[j] if np.isnan(lengths[j]) else lengths[j] * way
    legs = [INDEX[f"left_{name}"] for name in ("hip", "knee", "ankle")]
    offsets[0] = [0.0, 0.0, ANKLE_HEIGHT * height - offsets[legs, 2].sum()]
    return Performer(height_m=height, offsets_m=offsets)


def bone_lengths(walk: Walk) -> NDArray[np.float64]:
    """Return the length of each joint's bone to its parent [m], the same on both sides, shape (21,); NaN = unseen."""
    parents = np.maximum(PARENTS, 0)
    bones = walk.positions - walk.positions[:, :, parents]
    weights = np.minimum(walk.weights, walk.weights[:, :, parents])
    used = np.where(weights > 0, weights, np.nan)
    counts = np.isfinite(used).sum(axis=(0, 1))
    out = np.full(JOINT_COUNT, np.nan)
    for j in range(1, JOINT_COUNT):
        if counts[j] == 0:
            continue
        sure = used[:, :, j] >= _SURE * np.nanmedian(used[:, :, j])
        squares = _squared_lengths(np.where(sure[..., None], bones[:, :, j], np.nan))
        if squares:
            value, count = np.array(squares).T
            out[j] = np.sqrt(max(float(value @ count / count.sum()), 0.0))
    both = np.stack([out, out[MIRROR]])
    seen = np.isfinite(both)
    return np.divide(
        np.where(seen, both, 0.0).sum(axis=0),
        seen.sum(axis=0),
        out=np.full(JOINT_COUNT, np.nan),
        where=seen.any(axis=0),
    )


def _squared_lengths(bone: NDArray[np.float64]) -> list[tuple[float, int]]:
    """Return estimates of a bone's squared length [m^2] with their sample counts.

    Args:
        bone: the bone's vector by camera and instant [m], shape (camera_count, instant_count, 3); NaN = unseen.
    """
    out = []
    for a, b in combinations(bone, 2):
        product = (a * b).sum(axis=1)
        product = product[np.isfinite(product)]
        if len(product) >= _MIN_SAMPLES:
            out.append((_robust_mean(product), len(product)))
    if out:
        return out
    for mine in bone:
        length = np.linalg.norm(mine, axis=1)
        length = length[np.isfinite(length)]
        if len(length) >= _MIN_SAMPLES:
            middle = float(np.median(length))
            spread = 1.48 * float(np.median(np.abs(length - middle)))
            out.append((max(middle**2 - 2.0 * spread**2, (0.7 * middle) ** 2), len(length)))
    return out


def _robust_mean(values: NDArray[np.float64]) -> float:
    mean = float(np.median(values))
    for _ in range(10):
        scale = max(1.48 * float(np.median(np.abs(values - mean))), 1e-6)
        weight = (1.0 + ((values - mean) / (4.0 * scale)) ** 2) ** -2
        mean = float(weight @ values / weight.sum())
    return mean


def _trunk_positions(walk: Walk) -> NDArray[np.float64]:
    """Return the trunk's joints from the hips in the trunk's axes (left x, back y, up z) [m], shape (21, 3).

    Medians over the walk, NaN where a joint was not seen. Up is from the hips to the neck, else to between the
    shoulders; left is along shoulders and hips.
    """
    joints = walk.sure()
    lines = [
        joints[:, INDEX[f"left_{name}"]] - joints[:, INDEX[f"right_{name}"]] for name in ("shoulder", "hip")
    ]
    across = np.where(np.isfinite(lines), lines, 0.0).sum(axis=0)
    shoulders = (joints[:, INDEX["left_shoulder"]] + joints[:, INDEX["right_shoulder"]]) / 2
    neck = joints[:, INDEX["neck"]]
    top = np.where(np.isfinite(neck), neck, shoulders)
    z = unit(top - joints[:, INDEX["hips"]])
    x = unit(across - (across * z).sum(axis=1, keepdims=True) * z)
    axes = np.stack([x, np.cross(z, x), z], axis=1)  # rows are the trunk's axes
    toes = [joints[:, INDEX[f"{side}_toe"]] - joints[:, INDEX[f"{side}_ankle"]] for side in ("left", "right")]
    toes = np.where(np.isfinite(toes), toes, 0.0).sum(axis=0)
    exchanged = (toes * axes[:, 1]).sum(axis=1) > 0  # toes that point backwards: left and right are swapped
    from_hips = joints - joints[:, :1]
    from_hips[exchanged] = from_hips[exchanged][:, MIRROR]
    axes[exchanged, :2] *= -1
    local = np.einsum("fij,fkj->fki", axes, from_hips)
    out = np.full((JOINT_COUNT, 3), np.nan)
    for j in (INDEX[name] for name in _TRUNK):
        seen = local[np.isfinite(local[:, j]).all(axis=1), j]
        if len(seen) >= _MIN_SAMPLES:
            out[j] = np.median(seen, axis=0)
    return out


def _symmetric(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return positions that are the same on both sides; a missing side is a mirror image of the other."""
    flipped = positions[MIRROR] * [-1.0, 1.0, 1.0]
    here, there = np.isfinite(positions), np.isfinite(flipped)
    return np.where(here & there, (positions + flipped) / 2, np.where(here, positions, flipped))


def _between(name: str, trunk: NDArray[np.float64], usual: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the place of a missing trunk joint from the hips [m]: at its usual share of the line to the neck."""
    here = usual[INDEX[name]] - usual[0]
    neck, usual_neck = trunk[INDEX["neck"]], usual[INDEX["neck"]] - usual[0]
    if name in ("spine", "chest") and np.isfinite(neck).all():
        return neck * here[2] / usual_neck[2]
    return here


def _height(trunk: NDArray[np.float64], lengths: NDArray[np.float64], walk: Walk) -> float | None:
    """Return the standing height [m] from the chain of bones, else from the height of the head; None where unseen."""
    chain = trunk[[INDEX["head"], INDEX["left_hip"]], 2]
    legs = lengths[[INDEX["left_knee"], INDEX["left_ankle"]]]
    if np.isfinite(chain).all() and np.isfinite(legs).all():
        return float((chain[0] - chain[1] + legs.sum()) / (1.0 - TOP_OF_HEAD - ANKLE_HEIGHT))
    heads = walk.merged[:, INDEX["head"], 2]
    heads = heads[np.isfinite(heads)]
    return float(np.median(heads) / (1.0 - TOP_OF_HEAD)) if len(heads) >= _MIN_SAMPLES else None
