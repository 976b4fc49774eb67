"""Compiled parts of `head_follower`: a correction of the head's state by the rays of the face's landmarks."""

import math

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled

Array = NDArray[np.float64]

TURN, SHIFT, SIZE, STATE = slice(0, 3), slice(3, 6), 6, 7
"""Parts of an error of the state, and how many numbers it has: turn [rad], shift [m], and the size's logarithm."""

ACROSS_M, COMMON_M = 0.025, 0.02
"""Usual error of one landmark of a face across its ray [m], where lasting errors count again in every frame; and the
error that all landmarks of one camera share."""

CAUCHY = 2.0
"""Residual, in usual errors, from which a landmark's weight falls."""

MOST_M = 0.15
"""Limit to which each distance between ray and landmark is clipped for the mean."""

BEHIND = -0.25
BEHIND_TIMES, TURNED_EAR_TIMES = 5.0, 2.0
"""Factors of the error of a landmark, and of an ear, whose side of the head is turned from the camera further than
this cosine: the network guesses the landmark from the body, but sees ears from behind."""

ROUNDS, ENOUGH = 6, 1e-3
"""Most Gauss-Newton steps; the iteration also ends after a step whose largest number is below this [rad, m]."""


@compiled
def turned_by(vector: Array, rotation: Array) -> Array:
    """Return the rotation of a vector [rad], in the axes of the first one's outside, times a rotation, 3x3."""
    angle = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    first = np.eye(3)
    if angle > 1e-12:
        x, y, z = vector[0] / angle, vector[1] / angle, vector[2] / angle
        s, r = math.sin(angle), 1.0 - math.cos(angle)
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        for i in range(3):
            for j in range(3):
                square = 0.0
                for k in range(3):
                    square += cross[i, k] * cross[k, j]
                first[i, j] += s * cross[i, j] + r * square
    out = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                out[i, j] += first[i, k] * rotation[k, j]
    return out


@compiled
def turn_between(after: Array, before: Array) -> Array:
    """Return the vector [rad] by which `turned_by` takes one rotation to another, shape (3,)."""
    r = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                r[i, j] += after[i, k] * before[j, k]
    axis = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine = 0.5 * math.sqrt(axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2)
    angle = math.atan2(sine, 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0))
    return 0.5 * axis * (angle / sine) if sine > 1e-9 else 0.5 * axis


@compiled
def face_points(turn: Array, shift: Array, size: float, places: Array) -> Array:
    """Return the face's landmarks [m], shape (11, 3), of a head's state."""
    out = np.empty(places.shape)
    for n in range(len(places)):
        for a in range(3):
            out[n, a] = shift[a]
            for b in range(3):
                out[n, a] += math.exp(size) * turn[a, b] * places[n, b]
    return out


@compiled
def usual_errors(turn: Array, shift: Array, centre: Array, places: Array, ears: NDArray[np.int64]) -> Array:
    """Return the factors of the usual error for one camera's landmarks, shape (11,): see `BEHIND`."""
    out, to_eye = np.ones(len(places)), np.zeros(3)
    away = centre - shift
    away /= math.sqrt(away[0] ** 2 + away[1] ** 2 + away[2] ** 2)
    for a in range(3):
        for b in range(3):
            to_eye[a] += turn[b, a] * away[b]
    for n in range(len(places)):
        length, along = 0.0, 0.0
        for a in range(3):
            length += places[n, a] ** 2
            along += places[n, a] * to_eye[a]
        if along < BEHIND * math.sqrt(length):
            out[n] = TURNED_EAR_TIMES if n == ears[0] or n == ears[1] else BEHIND_TIMES
    return out


@compiled
def missed_m(points: Array, rays: Array, centre: Array) -> float:
    """Return the mean distance at which one camera's rays, shape (11, 3), miss points, shape (11, 3) [m], each
    distance clipped to `MOST_M`; infinite where it sees none."""
    total, count = 0.0, 0
    for row in range(len(points)):
        if not rays[row, 0] == rays[row, 0]:
            continue
        along, off = 0.0, 0.0
        for a in range(3):
            along += rays[row, a] * (points[row, a] - centre[a])
        for a in range(3):
            off += (points[row, a] - centre[a] - along * rays[row, a]) ** 2
        total += min(math.sqrt(off), MOST_M)
        count += 1
    return total / count if count else math.inf


@compiled
def _told(
    points: Array,
    middle: Array,
    rays: Array,
    centre: Array,
    shift: Array,
    usual_m: Array,
    matrix: Array,
    side: Array,
) -> tuple[Array, Array, Array]:
    """Add one camera's rays to the normal equations of the state, in place in `matrix` and `side`.

    Returns the equations of the camera's own shift of the face: its matrix (3, 3), the one of shift and state
    (3, STATE), and the right side (3,); zero where it sees nothing.
    """
    own, mixed, pull = np.zeros((3, 3)), np.zeros((3, STATE)), np.zeros(3)
    jacobian, across = np.zeros((3, STATE)), np.zeros((3, STATE))
    for row in range(len(points)):
        if not rays[row, 0] == rays[row, 0]:
            continue
        u, away, along, off = rays[row], points[row] + shift - centre, 0.0, 0.0
        for a in range(3):
            along += u[a] * away[a]
        for a in range(3):
            away[a] -= along * u[a]
            off += away[a] * away[a]
        weight = 1.0 / (usual_m[row] * usual_m[row])
        weight /= 1.0 + off * weight / (CAUCHY * CAUCHY)
        arm = points[row] - middle
        for a in range(3):
            b, d = (a + 1) % 3, (a + 2) % 3
            jacobian[a, b], jacobian[a, d] = arm[d], -arm[b]
            jacobian[a, 3 + a], jacobian[a, 6] = 1.0, arm[a]
        for i in range(STATE):
            on_ray = 0.0
            for a in range(3):
                on_ray += u[a] * jacobian[a, i]
            for a in range(3):
                across[a, i] = jacobian[a, i] - on_ray * u[a]
        for a in range(3):
            pull[a] -= weight * away[a]
            for b in range(3):
                own[a, b] += weight * ((1.0 if a == b else 0.0) - u[a] * u[b])
            for i in range(STATE):
                mixed[a, i] += weight * across[a, i]
                side[i] -= weight * across[a, i] * away[a]
                for j in range(STATE):
                    matrix[i, j] += weight * across[a, i] * across[a, j]
    return own, mixed, pull


@compiled
def corrected(
    turn: Array,
    shift: Array,
    size: float,
    covariance: Array,
    rays: Array,
    centres: Array,
    places: Array,
    ears: NDArray[np.int64],
    across_m: float,
) -> tuple[Array, Array, float, Array]:
    """Return a head's state and covariance after a robust iterated Kalman update by the cameras' rays.

    Args:
        turn: the head's expected rotation, 3x3, and its covariance, (STATE, STATE).
        shift: the expected place of the middle of the ears [m], shape (3,).
        size: the expected logarithm of the face's size.
        covariance: of the errors of all three.
        rays: unit directions of the landmarks from the cameras, shape (camera_count, 11, 3); NaN = unseen.
        centres: the cameras [m], shape (camera_count, 3).
        places: of the landmarks on the head [m], shape (11, 3).
        ears: their rows, shape (2,).
        across_m: usual error of a landmark [m].
    """
    prior = np.linalg.inv(covariance)
    matrix = prior.copy()
    new_turn, new_shift, new_size = turn.copy(), shift.copy(), size
    shifts = np.zeros((len(rays), 3))
    for _ in range(ROUNDS):
        error = np.zeros(STATE)
        error[:3] = turn_between(new_turn, turn)
        error[3:6] = new_shift - shift
        error[6] = new_size - size
        matrix, side = prior.copy(), -(prior @ error)
        points = face_points(new_turn, new_shift, new_size, places)
        gains, offs = np.zeros((len(rays), 3, STATE)), np.zeros((len(rays), 3))
        for c in range(len(rays)):
            times = usual_errors(new_turn, new_shift, centres[c], places, ears)
            own, mixed, pull = _told(
                points, new_shift, rays[c], centres[c], shifts[c], across_m * times, matrix, side
            )
            if own[0, 0] == 0.0:
                continue
            for a in range(3):  # add the camera's own shift, then eliminate it (Schur complement)
                own[a, a] += 1.0 / (COMMON_M * COMMON_M)
                pull[a] -= shifts[c, a] / (COMMON_M * COMMON_M)
            gains[c], offs[c] = np.linalg.solve(own, mixed), np.linalg.solve(own, pull)
            for i in range(STATE):
                for a in range(3):
                    side[i] -= mixed[a, i] * offs[c, a]
                    for j in range(STATE):
                        matrix[i, j] -= mixed[a, i] * gains[c, a, j]
        step = np.linalg.solve(matrix, side)
        for c in range(len(rays)):
            shifts[c] += offs[c] - gains[c] @ step
        new_turn = turned_by(step[:3], new_turn)
        new_shift = new_shift + step[3:6]
        new_size += step[6]
        if np.abs(step).max() < ENOUGH:
            break
    after = np.linalg.inv(matrix).astype(np.float64)
    return new_turn, new_shift, float(new_size), after
