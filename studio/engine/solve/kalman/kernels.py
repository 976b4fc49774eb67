"""The filter's arithmetic on small arrays, compiled, because numpy's calls would cost more than the arithmetic."""

import math

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled

Array = NDArray[np.float64]


@compiled
def move_on(both: Array, density: Array, rest_rate: Array, dt: float, keep: float) -> Array:
    """Predict a state's covariance, in place, and return each hinge's step to rest, 0..1, shape (hinges,).

    Args:
        both: covariance of configuration and velocity, shape (2 nv, 2 nv).
        density: of the accelerations, shape (nv,).
        rest_rate: information per second that a hinge is at rest, shape (hinge_count,).
        dt: time step [s].
        keep: share of the velocity that is kept.
    """
    nv = len(density)
    free = nv - len(rest_rate)
    gain = np.zeros(len(rest_rate))
    share = np.ones(nv)
    for i in range(nv):
        variance = both[i, i] + dt * (both[i, nv + i] + both[nv + i, i] + dt * both[nv + i, nv + i])
        variance += density[i] * (dt * dt * dt / 3.0)
        if i >= free:
            gain[i - free] = variance / (variance + 1.0 / (rest_rate[i - free] * max(dt, 1e-6)))
            share[i] = math.sqrt(1.0 - gain[i - free])
    for i in range(nv):
        for j in range(nv):
            speed = both[nv + i, nv + j]
            across = both[i, nv + j] + dt * speed
            place = both[i, j] + dt * (both[nv + i, j] + across)
            if i == j:
                place += density[i] * (dt * dt * dt / 3.0)
            both[i, j] = share[i] * share[j] * place
    for i in range(nv):
        for j in range(nv):
            across = keep * (both[i, nv + j] + dt * both[nv + i, nv + j])
            if i == j:
                across += density[i] * (dt * dt / 2.0)
            both[i, nv + j] = share[i] * across
            both[nv + j, i] = both[i, nv + j]
    for i in range(nv):
        for j in range(nv):
            both[nv + i, nv + j] *= keep * keep
        both[nv + i, nv + i] += density[i] * dt
    return gain


@compiled
def lessen(both: Array, lower: Array) -> None:
    """Subtract from a covariance, in place, a symmetric matrix given by its lower triangle, shapes (n, n)."""
    for i in range(len(both)):
        for j in range(i + 1):
            both[i, j] -= lower[i, j]
            both[j, i] = both[i, j]


@compiled
def pulled(
    positions: Array, information: Array, joints: Array, cauchy: float
) -> tuple[Array, Array, Array, Array]:
    """Return the information of rows on joints (see `ReadingRows.pull`), and the squared normalised residuals.

    Args:
        positions: shape (row_count, 21, 3) [m].
        information: shape (row_count, 21, 3, 3) [1/m2].
        joints: shape (21, 3) [m].
        cauchy: normalised residual from which a row's weight falls.

    Returns:
        Information, shape (21, 3, 3), pull, shape (21, 3), weights and squares, shape (row_count, 21).
    """
    rows, count = positions.shape[:2]
    total, pull = np.zeros((count, 3, 3)), np.zeros((count, 3))
    share, squares = np.empty((rows, count)), np.empty((rows, count))
    toward = np.empty(3)
    for r in range(rows):
        for k in range(count):
            squared = 0.0
            for a in range(3):
                toward[a] = 0.0
                for b in range(3):
                    toward[a] += information[r, k, a, b] * (positions[r, k, b] - joints[k, b])
                squared += toward[a] * (positions[r, k, a] - joints[k, a])
            weight = 1.0 / (1.0 + squared / (cauchy * cauchy))
            share[r, k], squares[r, k] = weight, squared
            for a in range(3):
                pull[k, a] += weight * toward[a]
                for b in range(3):
                    total[k, a, b] += weight * information[r, k, a, b]
    return total, pull, share, squares


@compiled
def middles(positions: Array, information: Array) -> tuple[Array, Array]:
    """`ReadingRows.middle` of positions, shape (row_count, 21, 3), and information, shape (row_count, 21, 3, 3)."""
    rows, count = positions.shape[:2]
    mean, root = np.full((count, 3), np.nan), np.zeros(count)
    for k in range(count):
        total = 0.0
        for r in range(rows):
            total += (information[r, k, 0, 0] + information[r, k, 1, 1] + information[r, k, 2, 2]) / 3.0
        if total <= 0.0:
            continue
        root[k] = math.sqrt(total)
        for a in range(3):
            mean[k, a] = 0.0
            for r in range(rows):
                weight = (information[r, k, 0, 0] + information[r, k, 1, 1] + information[r, k, 2, 2]) / 3.0
                mean[k, a] += weight * positions[r, k, a]
            mean[k, a] /= total
    return mean, root


@compiled
def ray_middles(positions: Array, information: Array) -> tuple[Array, Array]:
    """As `middles`, where some rows are known only across their rays: the least-squares places."""
    rows, count = positions.shape[:2]
    mean, root = np.full((count, 3), np.nan), np.zeros(count)
    for k in range(count):
        total, side = np.zeros((3, 3)), np.zeros(3)
        for r in range(rows):
            for a in range(3):
                for b in range(3):
                    total[a, b] += information[r, k, a, b]
                    side[a] += information[r, k, a, b] * positions[r, k, b]
        trace = (total[0, 0] + total[1, 1] + total[2, 2]) / 3.0
        if trace > 0.0:
            root[k] = math.sqrt(trace)
            mean[k] = np.linalg.solve(total, side)
    return mean, root


@compiled
def on_expected(positions: Array, centres: Array, expected: Array, along_m: Array, most: Array) -> None:
    """Move joints along their rays, in place, to where they are expected.

    A joint whose depth was guessed keeps up to `most` [m] of the guess.

    Args:
        positions: shape (row_count, 21, 3) [m]; NaN = unseen.
        centres: the cameras, shape (row_count, 3) [m].
        expected: shape (row_count, 21, 3) [m].
        along_m: standard deviation along the ray [m], shape (row_count,); NaN = as depth cameras measure: not moved.
        most: shape (row_count,) [m].
    """
    direction = np.empty(3)
    for r in range(len(positions)):
        if not along_m[r] == along_m[r]:
            continue
        for k in range(positions.shape[1]):
            length, along = 0.0, 0.0
            for a in range(3):
                direction[a] = positions[r, k, a] - centres[r, a]
                length += direction[a] ** 2
            length = math.sqrt(length)
            for a in range(3):
                along += direction[a] / length * (expected[r, k, a] - centres[r, a])
            along = max(along, 0.1) + min(max(length - along, -most[r]), most[r])
            for a in range(3):
                positions[r, k, a] = centres[r, a] + direction[a] / length * along


@compiled
def mean_distances(
    positions: Array,
    expected: Array,
    of: NDArray[np.int64],
    against: NDArray[np.int64],
    centres: Array,
    depthless: NDArray[np.bool_],
) -> Array:
    """Mean distance of seen joints to their predictions, each clipped at 0.3 m, shape (row_count,).

    The joints of a depthless camera are compared across their rays.

    Args:
        positions: shape (row_count, 21, 3) [m]; NaN = unseen.
        expected: shape (21, 3) [m].
        centres: the cameras, shape (row_count, 3) [m].
        depthless: shape (row_count,).
        of: joints that are compared.
        against: the predicted joints that they are compared with.
    """
    out = np.zeros(len(positions))
    for r in range(len(positions)):
        known = 0
        for n in range(len(of)):
            squared = 0.0
            for a in range(3):
                squared += (positions[r, of[n], a] - expected[against[n], a]) ** 2
            if depthless[r]:
                length, along = 0.0, 0.0
                for a in range(3):
                    ray = positions[r, of[n], a] - centres[r, a]
                    length += ray * ray
                    along += ray * (positions[r, of[n], a] - expected[against[n], a])
                squared = max(squared - along * along / length, 0.0)
            if squared == squared:
                known += 1
                out[r] += min(math.sqrt(squared), 0.3)
        out[r] /= max(known, 1)
    return out


@compiled
def measured_blocks(
    spread: Array, information: Array, pull: Array, moved: Array, least: float
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Return the measurement covariance of the joints, the measured steps, and their rows in `spread`.

    Args:
        spread: covariance of the joints' predictions, shape (63, 63).
        information: shape (21, 3, 3) [1/m2]; joints with less than `least` are left out.
        pull: shape (21, 3) [1/m].
        moved: movement of the joints so far, shape (21, 3) [m].
        least: information [1/m2].
    """
    count = 0
    for k in range(len(information)):
        if information[k, 0, 0] + information[k, 1, 1] + information[k, 2, 2] > least:
            count += 1
    rows, wanted = np.empty(3 * count, dtype=np.int64), np.empty(3 * count)
    noise = np.empty((count, 3, 3))
    n = 0
    for k in range(len(information)):
        if information[k, 0, 0] + information[k, 1, 1] + information[k, 2, 2] <= least:
            continue
        m, own = information[k], noise[n]
        own[0, 0] = m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1]
        own[0, 1] = m[0, 2] * m[2, 1] - m[0, 1] * m[2, 2]
        own[0, 2] = m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]
        own[1, 1] = m[0, 0] * m[2, 2] - m[0, 2] * m[2, 0]
        own[1, 2] = m[0, 2] * m[1, 0] - m[0, 0] * m[1, 2]
        own[2, 2] = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
        determinant = m[0, 0] * own[0, 0] + m[1, 0] * own[0, 1] + m[2, 0] * own[0, 2]
        for a in range(3):
            for b in range(a, 3):
                own[a, b] /= determinant
                own[b, a] = own[a, b]
        for a in range(3):
            rows[3 * n + a] = 3 * k + a
            wanted[3 * n + a] = moved[k, a]
            for b in range(3):
                wanted[3 * n + a] += own[a, b] * pull[k, b]
        n += 1
    total = np.empty((3 * count, 3 * count))
    for i in range(3 * count):
        for j in range(3 * count):
            total[i, j] = spread[rows[i], rows[j]]
    for n in range(count):
        for a in range(3):
            for b in range(3):
                total[3 * n + a, 3 * n + b] += noise[n, a, b]
    return total, wanted, rows


@compiled
def shown(
    positions: Array,
    confidence: Array,
    used: NDArray[np.bool_],
    exchanged: NDArray[np.bool_],
    mirror: NDArray[np.int64],
) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the mean of the cameras' used joints: positions, shape (21, 3), NaN where there is none; confidence,
    shape (21,); and which joints are used and seen, shape (camera_count, 21).

    Args:
        positions: shape (camera_count, 21, 3) [m]; NaN = unseen.
        confidence: shape (camera_count, 21).
        used: shape (camera_count, 21).
        exchanged: cameras whose left and right are exchanged, shape (camera_count,).
        mirror: the joint on the other side, shape (21,).
    """
    cameras, count = confidence.shape
    mean, sure = np.full((count, 3), np.nan), np.zeros(count)
    seen, in_use = np.zeros((cameras, count), dtype=np.bool_), np.zeros((cameras, count), dtype=np.bool_)
    for k in range(count):
        total, x, y, z = 0.0, 0.0, 0.0, 0.0
        for c in range(cameras):
            j = mirror[k] if exchanged[c] else k
            seen[c, k] = positions[c, j, 0] == positions[c, j, 0]
            in_use[c, k] = seen[c, k] and used[c, k]
            if in_use[c, k]:
                weight = max(confidence[c, j], 0.05) ** 2
                total += weight
                x += weight * positions[c, j, 0]
                y += weight * positions[c, j, 1]
                z += weight * positions[c, j, 2]
                sure[k] = max(sure[k], confidence[c, j])
        if total > 0.0:
            mean[k, 0], mean[k, 1], mean[k, 2] = x / total, y / total, z / total
    return mean, sure, seen, in_use
