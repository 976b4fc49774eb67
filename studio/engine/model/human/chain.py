"""A chain of bodies, compiled: its forward kinematics, and its fit to joints from many starts.

Every body has its hinges at its origin, as in the humanoid. The fit is Gauss-Newton within the hinges' ranges. Both
are in one module, since a compiled function may call only functions of its own module.
"""

import math

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.compiled import compiled

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

LONGEST_STEP_RAD = 0.6
DAMPING = 1e-3


@compiled
def placed(
    carrier: Array, parents: Indices, offsets: Array, body_of: Indices, axes: Array, hinges: Array
) -> tuple[Array, Array, Array]:
    """Return the bodies' rotations, shape (body_count, 3, 3), their positions [m], shape (body_count, 3), and the
    hinges' axes in the stage frame, shape (hinge_count, 3).

    Args:
        carrier: rotation and position of the body that carries the chain, shape (3, 4).
        parents: index of each body's parent, parents first, -1 = the carrier, shape (body_count,).
        offsets: of each body in its parent [m], shape (body_count, 3).
        body_of: the body that each hinge turns, ascending, shape (hinge_count,).
        axes: of the hinges in their body, shape (hinge_count, 3).
        hinges: angles [rad], shape (hinge_count,).
    """
    turns, places = np.empty((len(offsets), 3, 3)), np.empty((len(offsets), 3))
    pointed, hinge = np.empty((len(hinges), 3)), 0
    turn, row = np.empty((3, 3)), np.empty(3)
    for body in range(len(offsets)):
        parent = parents[body]
        for a in range(3):
            places[body, a] = carrier[a, 3] if parent < 0 else places[parent, a]
            for b in range(3):
                turn[a, b] = carrier[a, b] if parent < 0 else turns[parent, a, b]
                places[body, a] += turn[a, b] * offsets[body, b]
        while hinge < len(hinges) and body_of[hinge] == body:
            x, y, z = axes[hinge, 0], axes[hinge, 1], axes[hinge, 2]
            c, s = math.cos(hinges[hinge]), math.sin(hinges[hinge])
            d = 1.0 - c
            for a in range(3):
                row[0], row[1], row[2] = turn[a, 0], turn[a, 1], turn[a, 2]
                along = row[0] * x + row[1] * y + row[2] * z
                pointed[hinge, a] = along
                turn[a, 0] = c * row[0] + s * (row[1] * z - row[2] * y) + d * along * x
                turn[a, 1] = c * row[1] + s * (row[2] * x - row[0] * z) + d * along * y
                turn[a, 2] = c * row[2] + s * (row[0] * y - row[1] * x) + d * along * z
            hinge += 1
        for a in range(3):
            for b in range(3):
                turns[body, a, b] = turn[a, b]
    return turns, places, pointed


@compiled
def errors(
    turns: Array, places: Array, on: Indices, at: Array, targets: Array, share: Array
) -> tuple[Array, Array]:
    """Return the joints' positions [m] and their weighted errors, each of shape (joint_count, 3).

    Args:
        turns, places: of the bodies, as `placed` returns them.
        on: the body that carries each joint, shape (joint_count,).
        at: the joint's position in that body [m], shape (joint_count, 3).
        targets: of the joints [m], shape (joint_count, 3).
        share: weight of each joint, shape (joint_count,).
    """
    points, off = np.empty((len(on), 3)), np.empty((len(on), 3))
    for j in range(len(on)):
        for a in range(3):
            points[j, a] = places[on[j], a]
            for b in range(3):
                points[j, a] += turns[on[j], a, b] * at[j, b]
            off[j, a] = share[j] * (points[j, a] - targets[j, a])
    return points, off


@compiled
def solve_in_place(H: Array, g: Array) -> None:
    """Solve H x = g by Cholesky factors and put x into g. The factors overwrite the lower half of H.

    Args:
        H: symmetric and positive definite, shape (n, n); only its lower half is read.
        g: shape (n,).
    """
    n = len(g)
    for i in range(n):
        for j in range(i + 1):
            rest = H[i, j]
            for k in range(j):
                rest -= H[i, k] * H[j, k]
            H[i, j] = math.sqrt(rest) if i == j else rest / H[j, j]
    for i in range(n):
        for k in range(i):
            g[i] -= H[i, k] * g[k]
        g[i] /= H[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            g[i] -= H[k, i] * g[k]
        g[i] /= H[i, i]


@compiled
def refined(
    carrier: Array,
    parents: Indices,
    offsets: Array,
    body_of: Indices,
    axes: Array,
    on: Indices,
    at: Array,
    starts: Array,
    ranges: Array,
    rest: Array,
    stiffness: Array,
    targets: Array,
    share: Array,
    iterations: int,
) -> tuple[Array, Array]:
    """Return the cost and the hinges of each start after some steps, shapes (start_count,) and (start_count, n).

    Cost: the sum of the joints' squared weighted errors [m2] and of `stiffness` times the hinges' squared distances
    from rest.

    Args:
        carrier, parents, offsets, body_of, axes: the chain, as `placed` takes it; each body carries the next.
        on, at: the joints on it, as `errors` takes them.
        starts: angles [rad], shape (start_count, hinge_count).
        ranges: lowest and highest angle [rad], shape (2, hinge_count); equal ends hold a hinge.
        rest: shape (hinge_count,) [rad].
        stiffness: of the pull to rest, shape (hinge_count,) [m2/rad2].
        targets: of the joints [m], shape (joint_count, 3).
        share: weight of each joint, shape (joint_count,).
        iterations: steps per start.
    """
    count, n = starts.shape
    left, found = np.zeros(count), np.empty((count, n))
    J, free = np.empty((n, 3)), np.empty(n, dtype=np.bool_)
    H, step = np.empty((n, n)), np.empty(n)
    for start in range(count):
        hinges = found[start]
        for i in range(n):
            hinges[i] = min(max(starts[start, i], ranges[0, i]), ranges[1, i])
        for _ in range(iterations):
            turns, places, pointed = placed(carrier, parents, offsets, body_of, axes, hinges)
            points, off = errors(turns, places, on, at, targets, share)
            for i in range(n):
                step[i] = -stiffness[i] * (hinges[i] - rest[i])
                for k in range(i + 1):
                    H[i, k] = stiffness[i] + DAMPING if i == k else 0.0
            for j in range(len(on)):
                moving = 0
                while moving < n and body_of[moving] <= on[j]:
                    body = body_of[moving]
                    x, y = points[j, 0] - places[body, 0], points[j, 1] - places[body, 1]
                    z = points[j, 2] - places[body, 2]
                    J[moving, 0] = share[j] * (pointed[moving, 1] * z - pointed[moving, 2] * y)
                    J[moving, 1] = share[j] * (pointed[moving, 2] * x - pointed[moving, 0] * z)
                    J[moving, 2] = share[j] * (pointed[moving, 0] * y - pointed[moving, 1] * x)
                    moving += 1
                for i in range(moving):
                    step[i] -= J[i, 0] * off[j, 0] + J[i, 1] * off[j, 1] + J[i, 2] * off[j, 2]
                    for k in range(i + 1):
                        H[i, k] += J[i, 0] * J[k, 0] + J[i, 1] * J[k, 1] + J[i, 2] * J[k, 2]
            movable = 0
            for i in range(n):
                held = ranges[0, i] == ranges[1, i]
                low, high = hinges[i] <= ranges[0, i], hinges[i] >= ranges[1, i]
                free[i] = not (held or (low and step[i] < 0.0) or (high and step[i] > 0.0))
                movable += free[i]
            if movable == 0:
                break
            for i in range(n):
                if not free[i]:
                    step[i] = 0.0
                for k in range(i + 1):
                    if not (free[i] and free[k]):
                        H[i, k] = 1.0 if i == k else 0.0
            solve_in_place(H, step)
            for i in range(n):
                if free[i]:
                    moved = hinges[i] + min(max(step[i], -LONGEST_STEP_RAD), LONGEST_STEP_RAD)
                    hinges[i] = min(max(moved, ranges[0, i]), ranges[1, i])
        turns, places, _ = placed(carrier, parents, offsets, body_of, axes, hinges)
        _, off = errors(turns, places, on, at, targets, share)
        for j in range(len(on)):
            for a in range(3):
                left[start] += off[j, a] * off[j, a]
        for i in range(n):
            left[start] += stiffness[i] * (hinges[i] - rest[i]) ** 2
    return left, found
