"""Compiled parts of `fingers`: where a hand's landmarks are, and a correction of its state by rays."""

import math

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled

Array = NDArray[np.float64]

ACROSS_M = 0.012
"""Usual error of a hand's landmark across its ray [m]; lasting errors count again in every frame."""

TIMES = np.array([1.0, 2.5, 2.5, 1.5, 1.5] + [1.0, 1.3, 1.3, 1.5] * 4)
"""Factor of this error for each landmark: a thumb's root is ill-defined and moves in more ways than the model's, and
the fingers say less about the palm than its knuckles do."""

ALONE_M = 0.03
"""Usual error [m] where only one camera sees the hand: its errors then turn the whole hand."""

CAUCHY = 2.0
"""Residual, in usual errors, from which a landmark's weight falls."""

MOST_M = 0.06
"""Limit to which each distance is clipped for the mean distance `missed`."""

ROUNDS, COLD_ROUNDS = 4, 12
"""Most Gauss-Newton steps of a hand that is already followed, and of a new one."""

ENOUGH = 2e-3
"""The iteration ends after a step whose largest number is below this [rad, m]."""


@compiled
def _rotation(axis: Array, angle: float) -> Array:
    """Rotation about a unit vector, 3x3 (Rodrigues)."""
    s, c = math.sin(angle), math.cos(angle)
    x, y, z = axis[0], axis[1], axis[2]
    r = 1.0 - c
    return np.array(
        [
            [c + r * x * x, r * x * y - s * z, r * x * z + s * y],
            [r * x * y + s * z, c + r * y * y, r * y * z - s * x],
            [r * x * z - s * y, r * y * z + s * x, c + r * z * z],
        ]
    )


@compiled
def _times(a: Array, b: Array) -> Array:
    out = np.zeros((3, 3))
    for i in range(3):
        for k in range(3):
            for j in range(3):
                out[i, j] += a[i, k] * b[k, j]
    return out


@compiled
def _turned(a: Array, v: Array) -> Array:
    out = np.zeros(3)
    for i in range(3):
        for j in range(3):
            out[i] += a[i, j] * v[j]
    return out


@compiled
def _moves(
    jacobian: Array, row: int, column: int, axis: Array, anchor: Array, point: Array, ratio: float
) -> None:
    """Add how a hinge moves a landmark to the Jacobian."""
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        jacobian[row, a, column] += ratio * (
            axis[b] * (point[c] - anchor[c]) - axis[c] * (point[b] - anchor[b])
        )


@compiled
def hand_points(
    state: Array,
    forearm: Array,
    wrist: Array,
    offsets: Array,
    axes: Array,
    places: NDArray[np.int64],
    ratios: Array,
    wrist_axes: Array,
) -> tuple[Array, Array]:
    """Return a hand's landmarks [m], shape (21, 3), and their Jacobian by the state, shape (21, 3, STATE).

    Args:
        state: see `human.hand`.
        forearm: the forearm's world rotation without its twist, 3x3.
        wrist: the body's [m], shape (3,).
        offsets, axes, places, ratios, wrist_axes: as of `HandModel`.
    """
    points, jacobian = np.empty((21, 3)), np.zeros((21, 3, len(state)))
    start = wrist + state[:3]
    points[0] = start
    size = math.exp(state[6])
    hand = forearm
    wrist_world = np.empty((3, 3))
    for n in range(3):
        wrist_world[n] = _turned(hand, wrist_axes[n])
        hand = _times(hand, _rotation(wrist_axes[n], state[3 + n]))
    hinge_axes, anchors = np.empty((6, 3)), np.empty((6, 3))
    columns, shares = np.zeros(6, dtype=np.int64), np.ones(6)
    for f in range(5):
        at, turn, count = start, hand, 0
        for k in range(4):
            at = at + size * _turned(turn, offsets[f, k])
            row = 1 + 4 * f + k
            points[row] = at
            for n in range(count):
                _moves(jacobian, row, columns[n], hinge_axes[n], anchors[n], at, shares[n])
            for n in range(3):
                _moves(jacobian, row, 3 + n, wrist_world[n], start, at, 1.0)
            jacobian[row, :, 6] = at - start
            if k == 3:
                break
            for n in range(2):
                if places[f, k, n] == 0:
                    continue
                hinge_axes[count], anchors[count] = _turned(turn, axes[f, k, n]), at
                columns[count], shares[count] = places[f, k, n], ratios[f, k, n]
                turn = _times(turn, _rotation(axes[f, k, n], ratios[f, k, n] * state[places[f, k, n]]))
                count += 1
    for row in range(21):
        for a in range(3):
            jacobian[row, a, a] = 1.0
    return points, jacobian


@compiled
def corrected(
    expected: Array,
    covariance: Array,
    rays: Array,
    centres: Array,
    forearm: Array,
    wrist: Array,
    offsets: Array,
    axes: Array,
    places: NDArray[np.int64],
    ratios: Array,
    wrist_axes: Array,
    low: Array,
    high: Array,
    rounds: int,
) -> tuple[Array, Array, float]:
    """Return a hand's state and covariance after a robust iterated Kalman update by the cameras' rays, and the mean
    distance at which the rays then miss the hand [m], each distance clipped to `MOST_M`.

    Args:
        expected: the state before, shape (STATE,), and its covariance, (STATE, STATE).
        covariance: of `expected`.
        rays: unit directions of the landmarks from the cameras, shape (camera_count, 21, 3); NaN = unseen.
        centres: the cameras [m], shape (camera_count, 3).
        forearm, wrist, offsets, axes, places, ratios, wrist_axes: as of `hand_points`.
        low, high: ends of the state's ranges, shape (STATE,).
        rounds: most Gauss-Newton steps.
    """
    count = len(expected)
    prior = np.linalg.inv(covariance)
    state: Array = np.minimum(np.maximum(expected, low), high)
    matrix = prior.copy()
    cameras = 0
    for c in range(len(rays)):
        cameras += 0 if np.isnan(rays[c, :, 0]).all() else 1
    usual = ACROSS_M if cameras > 1 else ALONE_M
    missed = 0.0
    for _ in range(rounds):
        total, seen = 0.0, 0
        points, jacobian = hand_points(state, forearm, wrist, offsets, axes, places, ratios, wrist_axes)
        matrix, side = prior.copy(), prior @ (expected - state)
        for row in range(21):
            weights, pull = np.zeros((3, 3)), np.zeros(3)
            for c in range(len(rays)):
                if not rays[c, row, 0] == rays[c, row, 0]:
                    continue
                u, away, along = rays[c, row], points[row] - centres[c], 0.0
                for a in range(3):
                    along += u[a] * away[a]
                off = 0.0
                for a in range(3):
                    away[a] -= along * u[a]
                    off += away[a] * away[a]
                total += min(math.sqrt(off), MOST_M)
                seen += 1
                weight = 1.0 / (usual * TIMES[row]) ** 2
                weight /= 1.0 + off * weight / (CAUCHY * CAUCHY)
                for a in range(3):
                    pull[a] -= weight * away[a]
                    for b in range(3):
                        weights[a, b] += weight * ((1.0 if a == b else 0.0) - u[a] * u[b])
            if weights[0, 0] == 0.0:
                continue
            weighted = weights @ jacobian[row]
            for i in range(count):
                for a in range(3):
                    j_a = jacobian[row, a, i]
                    if j_a == 0.0:
                        continue
                    side[i] += j_a * pull[a]
                    for j in range(count):
                        matrix[i, j] += j_a * weighted[a, j]
        missed = total / max(seen, 1)
        step = np.linalg.solve(matrix, side)
        last = state
        state = np.minimum(np.maximum(state + step, low), high)
        if np.abs(state - last).max() < ENOUGH:
            break
    after = np.linalg.inv(matrix).astype(np.float64)
    return state, after, missed


@compiled
def missed_m(points: Array, rays: Array, centre: Array) -> float:
    """Return the mean distance at which one camera's rays, shape (21, 3), miss points, shape (21, 3) [m]; infinite
    where it sees none."""
    total, count = 0.0, 0
    for row in range(len(points)):
        if not rays[row, 0] == rays[row, 0]:
            continue
        along, off = 0.0, 0.0
        for a in range(3):
            along += rays[row, a] * (points[row, a] - centre[a])
        for a in range(3):
            off += (points[row, a] - centre[a] - along * rays[row, a]) ** 2
        total += math.sqrt(off)
        count += 1
    return total / count if count else math.inf


@compiled
def turn_hand(
    rotations: Array,
    state: Array,
    forearm: Array,
    fore: int,
    hand: int,
    joints: NDArray[np.int64],
    axes: Array,
    places: NDArray[np.int64],
    ratios: Array,
    wrist_axes: Array,
) -> None:
    """Set the world rotations of a forearm, its hand and its fingers, in place, in `rotations`, shape (52, 3, 3).

    Args:
        rotations: of all output joints.
        state, forearm: as of `hand_points`.
        fore, hand, joints: the output joints, those of the fingers of shape (5, 3).
        axes, places, ratios, wrist_axes: as of `HandModel`.
    """
    turn = _times(forearm, _rotation(wrist_axes[0], state[3]))
    rotations[fore] = turn
    for n in range(1, 3):
        turn = _times(turn, _rotation(wrist_axes[n], state[3 + n]))
    rotations[hand] = turn
    for f in range(5):
        bone = turn
        for k in range(3):
            for n in range(2):
                if places[f, k, n] > 0:
                    bone = _times(bone, _rotation(axes[f, k, n], ratios[f, k, n] * state[places[f, k, n]]))
            rotations[joints[f, k]] = bone
