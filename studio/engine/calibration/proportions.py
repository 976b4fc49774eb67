"""A performer's proportions: lengths of the bones and where the joints sit in a T-pose.

Lengths are measured over the whole calibration part. Noise makes a bone look too long (the mean of |d + n| is
more than |d|), so lengths come from products of two cameras' vectors of the same bone, whose noise is
independent (the mean of (d + n1).(d + n2) is |d|^2); with one camera the variance of the length is taken off.
"""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.floor import ANKLE_HEIGHT
from studio.engine.calibration.merge import Walk
from studio.engine.calibration.result import Performer
from studio.engine.joints import CANONICAL, INDEX, JOINT_COUNT, MIRROR, PARENTS

TOP_OF_HEAD = 0.075
"""Top of the head over the head joint (the middle of the head), as a share of the standing height."""

ANTHROPOMETRIC: dict[str, tuple[float, float, float]] = {
    "hips": (0.0, 0.0, 0.530), "spine": (0.0, 0.0, 0.080), "chest": (0.0, 0.0, 0.170), "neck": (0.0, 0.0, 0.060),
    "head": (0.0, 0.0, 0.085),
    "left_shoulder": (0.129, 0.0, -0.012), "left_elbow": (0.186, 0.0, 0.0), "left_wrist": (0.146, 0.0, 0.0),
    "left_hand": (0.054, 0.0, 0.0), "left_hip": (0.052, 0.0, -0.020), "left_knee": (0.0, 0.0, -0.245),
    "left_ankle": (0.0, 0.0, -0.246), "left_toe": (0.0, -0.075, -0.025),
}  # fmt: skip
"""Offsets from the parent in a T-pose as shares of the height, for joints that no camera reports.

Source: Drillis and Contini, "Body segment parameters", 1966, as in Winter, "Biomechanics and motor control of
human movement", 4th edition, figure 4.1 (upper arm 0.186, forearm 0.146, half hand 0.054, half shoulder width
0.129, thigh 0.245, shank 0.246, hip height 0.530, half of the foot's length 0.075); half the distance of the hip
joints' centres 0.052 from Bell, Pedersen and Brand, "A comparison of the accuracy of several hip center location
prediction methods", 1990; the trunk is divided as canonical joints lie on it.
"""

_MIN_SAMPLES = 20
_SURE = 0.25


def anthropometric_offsets(height_m: float) -> NDArray[np.float64]:
    """Return T-pose offsets of an average person [m], shape (21, 3), as `Performer.offsets_m`."""
    out = np.zeros((JOINT_COUNT, 3))
    for name, offset in ANTHROPOMETRIC.items():
        out[INDEX[name]] = offset
        out[MIRROR[INDEX[name]]] = np.array(offset) * ([-1.0, 1.0, 1.0] if "_" in name else [1.0, 1.0, 1.0])
    return out * height_m


def measure(walk: Walk) -> Performer | None:
    """Return the performer of a walk in the stage frame (z up); None where too little of a body was seen."""
    lengths = bone_lengths(walk)
    offsets = np.full((JOINT_COUNT, 3), np.nan)
    local = _trunk_offsets(walk)
    for name in (
        "spine",
        "chest",
        "neck",
        "head",
        "left_shoulder",
        "right_shoulder",
        "left_hip",
        "right_hip",
    ):
        offsets[INDEX[name]] = local[INDEX[name]]
    for name in ("elbow", "wrist", "hand"):
        offsets[INDEX[f"left_{name}"]] = [lengths[INDEX[f"left_{name}"]], 0.0, 0.0]
    for name in ("knee", "ankle"):
        offsets[INDEX[f"left_{name}"]] = [0.0, 0.0, -lengths[INDEX[f"left_{name}"]]]
    offsets = _symmetric(offsets)
    height = _height(offsets, lengths, walk)
    if height is None:
        return None
    usual = anthropometric_offsets(height)
    usual_foot, foot = usual[INDEX["left_toe"]], lengths[INDEX["left_toe"]]
    offsets[INDEX["left_toe"]] = (
        usual_foot if np.isnan(foot) else foot * usual_foot / np.linalg.norm(usual_foot)
    )
    offsets = _symmetric(offsets)
    missing = ~np.isfinite(offsets).all(axis=1)
    offsets = _fill(offsets, usual, missing)
    legs = [INDEX[f"left_{name}"] for name in ("hip", "knee", "ankle")]
    offsets[0] = [0.0, 0.0, ANKLE_HEIGHT * height - offsets[legs, 2].sum()]
    return Performer(height_m=float(height), offsets_m=offsets)


def bone_lengths(walk: Walk) -> NDArray[np.float64]:
    """Return the length of each joint's bone to its parent [m], shape (21,), the same on both sides; NaN = unseen."""
    squares: list[list[tuple[float, int]]] = [[] for _ in range(JOINT_COUNT)]
    cameras = len(walk.positions)
    parents = np.maximum(PARENTS, 0)
    bones = walk.positions - walk.positions[:, :, parents]
    sure = np.minimum(walk.weights, walk.weights[:, :, parents])
    bones[
        sure < _SURE * np.median(walk.weights[walk.weights > 0]) if (walk.weights > 0).any() else sure < 0
    ] = np.nan
    if cameras == 1:
        length = np.linalg.norm(bones[0], axis=2)
        for j in range(1, JOINT_COUNT):
            seen = length[np.isfinite(length[:, j]), j]
            if len(seen) >= _MIN_SAMPLES:
                middle = float(np.median(seen))
                spread = 1.48 * float(np.median(np.abs(seen - middle)))
                squares[j].append((max(middle**2 - 2.0 * spread**2, (0.7 * middle) ** 2), len(seen)))
    for a, b in combinations(range(cameras), 2):
        product = (bones[a] * bones[b]).sum(axis=2)
        for j in range(1, JOINT_COUNT):
            seen = product[np.isfinite(product[:, j]), j]
            if len(seen) >= _MIN_SAMPLES:
                squares[j].append((_robust_mean(seen), len(seen)))
    out = np.full(JOINT_COUNT, np.nan)
    for j in range(1, JOINT_COUNT):
        both = squares[j] + (squares[MIRROR[j]] if MIRROR[j] != j else [])
        if both:
            values, counts = np.array(both).T
            out[j] = np.sqrt(max(float(values @ counts / counts.sum()), 0.0))
    return out


def _robust_mean(values: NDArray[np.float64]) -> float:
    mean = float(np.median(values))
    for _ in range(10):
        scale = max(1.48 * float(np.median(np.abs(values - mean))), 1e-6)
        weight = (1.0 + ((values - mean) / (4.0 * scale)) ** 2) ** -2
        mean = float(weight @ values / weight.sum())
    return mean


def _trunk_offsets(walk: Walk) -> NDArray[np.float64]:
    """Return median offsets from the parent in the trunk's axes (left x, back y, up z) [m], shape (21, 3)."""
    joints = walk.merged
    across = np.nansum(
        [
            joints[:, INDEX[f"left_{name}"]] - joints[:, INDEX[f"right_{name}"]]
            for name in ("shoulder", "hip")
        ],
        axis=0,
    )
    up = joints[:, INDEX["neck"]] - joints[:, INDEX["hips"]]
    z = up / np.linalg.norm(up, axis=1, keepdims=True)
    x = across - (across * z).sum(axis=1, keepdims=True) * z
    x = x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-9)
    axes = np.stack([x, np.cross(z, x), z], axis=1)  # rows are the trunk's axes
    toes = np.nansum(
        [joints[:, INDEX[f"{s}_toe"]] - joints[:, INDEX[f"{s}_ankle"]] for s in ("left", "right")], axis=0
    )
    exchanged = (toes * axes[:, 1]).sum(axis=1) > 0  # the toes point backwards: left and right are exchanged
    offsets = joints - joints[:, np.maximum(PARENTS, 0)]
    offsets[exchanged] = offsets[exchanged][:, MIRROR]
    axes[exchanged, :2] *= -1
    local = np.einsum("fij,fkj->fki", axes, offsets)
    out = np.full((JOINT_COUNT, 3), np.nan)
    for j in range(1, JOINT_COUNT):
        seen = local[np.isfinite(local[:, j]).all(axis=1), j]
        if len(seen) >= _MIN_SAMPLES:
            out[j] = np.median(seen, axis=0)
    return out


def _symmetric(offsets: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return offsets that are the same on both sides; a side that is missing takes the other's."""
    flipped = offsets[MIRROR] * [-1.0, 1.0, 1.0]
    both = np.where(np.isfinite(offsets) & np.isfinite(flipped), (offsets + flipped) / 2, np.nan)
    one = np.where(np.isfinite(offsets), offsets, flipped)
    return np.where(np.isfinite(both), both, one)


def _height(offsets: NDArray[np.float64], lengths: NDArray[np.float64], walk: Walk) -> float | None:
    """Return the standing height [m] from the chain of bones, else from the body's extent; None where unseen."""
    chain = [INDEX[name] for name in ("spine", "chest", "neck", "head")]
    legs = [INDEX[f"left_{name}"] for name in ("hip", "knee", "ankle")]
    parts = offsets[chain + legs, 2]
    if np.isfinite(parts).all():
        return float((offsets[chain, 2].sum() - offsets[legs, 2].sum()) / (1.0 - TOP_OF_HEAD - ANKLE_HEIGHT))
    heads = walk.merged[:, INDEX["head"], 2]
    heads = heads[np.isfinite(heads)]
    if len(heads) >= _MIN_SAMPLES:
        return float(np.median(heads) / (1.0 - TOP_OF_HEAD))
    return None


def _fill(
    offsets: NDArray[np.float64], usual: NDArray[np.float64], missing: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the offsets with missing joints placed as on an average person.

    A missing joint inside the chain (no camera reports a chest) takes its usual share of the way to the next joint
    that was seen: offsets of its children were measured from nothing and are taken as usual too.
    """
    out = np.where(missing[:, None], usual, offsets)
    for j in range(1, JOINT_COUNT):
        if missing[PARENTS[j]] and PARENTS[j] != 0:
            out[j] = usual[j]
    return out
