"""Compiled parts of `person`: prediction of a person's joints, fit of bodies, correction by a reading, and bones.

Places, speeds and `cov` are by joint, shape (21, 3); `cov` holds the variances of place and speed, and their
covariance. `mirror` is `joints.MIRROR`, and `parents` has each joint's parent, its own index for the root.
"""

import math

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FADES_S = 0.3
SPEED_M_S = 1.5
READING_M = 0.10
"""Standard deviation of a camera's joint from that of the others; most of it is the same from frame to frame."""

WORST = 16.0
"""Limit of a joint's squared deviation, so that one wrong arm does not decide."""

PULLS = 4.0
"""Limit of a joint's pull: that at this many deviations from its prediction."""

LEAST_JOINTS = 5
MIRRORED_M = 0.03
BONES_KEPT = 900
"""Frames over which bones are averaged."""


@compiled
def predicted(place: Array, speed: Array, cov: Array, dt_s: float) -> tuple[Array, Array, Array]:
    """Return places, speeds and covariances some time later (an Ornstein-Uhlenbeck process)."""
    fade = math.exp(-dt_s / FADES_S)
    reach = FADES_S * (1.0 - fade)
    drawn = SPEED_M_S**2
    walked = drawn * (2 * FADES_S * dt_s - 4 * FADES_S**2 * (1 - fade) + FADES_S**2 * (1 - fade**2))
    out = np.empty_like(cov)
    for joint in range(len(cov)):
        at, fast, both = cov[joint, 0], cov[joint, 1], cov[joint, 2]
        out[joint, 0] = at + 2 * reach * both + reach**2 * fast + walked
        out[joint, 1] = fade**2 * fast + (1.0 - fade**2) * drawn
        out[joint, 2] = fade * (both + reach * fast) + drawn * FADES_S * (1 - fade) ** 2
    return place + reach * speed, fade * speed, out


@compiled
def deviations(place: Array, cov: Array, bodies: Array, mirror: Indices) -> Array:
    """Return the deviations of bodies, shape (body_count,): the mean square over its variance, of the body as it is
    or with its sides exchanged; infinite where too few joints are known."""
    out = np.full(len(bodies), np.inf)
    for body in range(len(bodies)):
        for exchanged in range(2):
            total, count = 0.0, 0
            for joint in range(len(place)):
                seen = bodies[body, mirror[joint] if exchanged else joint]
                square = 0.0
                for axis in range(3):
                    square += (seen[axis] - place[joint, axis]) ** 2
                square /= 3.0 * (cov[joint, 0] + READING_M**2)
                if math.isfinite(square):
                    total += min(square, WORST)
                    count += 1
            if count >= LEAST_JOINTS:
                out[body] = min(out[body], total / count)
    return out


@compiled
def upright(joints: Array, place: Array, mirror: Indices) -> Array:
    """Return the joints, with left and right exchanged if they then fit better."""
    as_told, exchanged, count = 0.0, 0.0, 0
    for joint in range(len(place)):
        one, other = 0.0, 0.0
        for axis in range(3):
            one += (joints[joint, axis] - place[joint, axis]) ** 2
            other += (joints[mirror[joint], axis] - place[joint, axis]) ** 2
        if math.isfinite(one) and math.isfinite(other):
            as_told += math.sqrt(one)
            exchanged += math.sqrt(other)
            count += 1
    if count and exchanged < as_told - MIRRORED_M * count:
        return joints[mirror]
    return joints


@compiled
def corrected(place: Array, speed: Array, cov: Array, joints: Array) -> tuple[Array, Array, Array]:
    """Return places, speeds and covariances with a reading of the joints [m]; NaN = unseen."""
    place, speed, cov = place.copy(), speed.copy(), cov.copy()
    for joint in range(len(place)):
        if not math.isfinite(joints[joint, 0]):
            continue
        if not math.isfinite(place[joint, 0]):
            place[joint], speed[joint] = joints[joint], 0.0
            cov[joint, 0], cov[joint, 1], cov[joint, 2] = READING_M**2, SPEED_M_S**2, 0.0
            continue
        total = cov[joint, 0] + READING_M**2
        away = 0.0
        for axis in range(3):
            away += (joints[joint, axis] - place[joint, axis]) ** 2
        pull = min(1.0, PULLS * math.sqrt(total) / max(math.sqrt(away), 1e-9))
        gain, gain_speed = cov[joint, 0] / total, cov[joint, 2] / total
        for axis in range(3):
            rest = pull * (joints[joint, axis] - place[joint, axis])
            place[joint, axis] += gain * rest
            speed[joint, axis] += gain_speed * rest
        cov[joint, 1] -= gain_speed * cov[joint, 2]
        cov[joint, 0] *= 1.0 - gain
        cov[joint, 2] *= 1.0 - gain
    return place, speed, cov


@compiled
def measure_bones(
    joints: Array, parents: Indices, mirror: Indices, bones: Array, frames: Array
) -> tuple[Array, Array]:
    """Return the sums of bones' lengths [m] and the numbers of their frames, shape (21,) each, with a body added.

    Both sides count as one.
    """
    lengths = np.empty(len(parents))
    for joint in range(len(parents)):
        square = 0.0
        for axis in range(3):
            square += (joints[joint, axis] - joints[parents[joint], axis]) ** 2
        lengths[joint] = math.sqrt(square)
    bones, frames = bones.copy(), frames.copy()
    for joint in range(len(parents)):
        total, count = 0.0, 0
        for one in (joint, mirror[joint]):
            if math.isfinite(lengths[one]):
                total += lengths[one]
                count += 1
        if frames[joint] >= BONES_KEPT:
            bones[joint] *= 1.0 - 1.0 / BONES_KEPT
            frames[joint] *= 1.0 - 1.0 / BONES_KEPT
        if count:
            bones[joint] += total / count
            frames[joint] += 1.0
    return bones, frames


@compiled
def expected_fit(
    place: Array, speed: Array, cov: Array, dt_s: float, bodies: Array, mirror: Indices
) -> tuple[Array, Array, Array, Array]:
    """Return `predicted`, and the `deviations` of bodies from it: one call costs less than two."""
    place, speed, cov = predicted(place, speed, cov, dt_s)
    return place, speed, cov, deviations(place, cov, bodies, mirror)


@compiled
def gone_on(
    place: Array,
    speed: Array,
    cov: Array,
    joints: Array,
    parents: Indices,
    mirror: Indices,
    bones: Array,
    frames: Array,
) -> tuple[Array, Array, Array, Array, Array]:
    """Return `corrected` and `measure_bones` of a reading that is brought `upright`."""
    joints = upright(joints, place, mirror)
    place, speed, cov = corrected(place, speed, cov, joints)
    bones, frames = measure_bones(joints, parents, mirror, bones, frames)
    return place, speed, cov, bones, frames
