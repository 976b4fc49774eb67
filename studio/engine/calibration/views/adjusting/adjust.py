"""Robust bundle adjustment: cameras, focal lengths, distortion, clocks, joints and bone lengths, all at once.

Gauss-Newton with Levenberg's damping. A frame's joints are coupled only by the bones, and to other frames only by the
cameras, so each frame's block is eliminated by itself (Schur's complement; Triggs et al., "Bundle adjustment: a
modern synthesis", 2000). Cauchy's cost keeps wrong landmarks from distorting the cameras.
"""

from dataclasses import dataclass, replace

import numpy as np

from studio.engine.calibration.views.adjusting.rig import AHEAD, BEND, CENTRE, FOCAL, UNKNOWNS, CameraRig
from studio.engine.calibration.views.seen.bodies import BONES, LENGTH_COUNT, LENGTH_OF, LIMBS, Array, known_of
from studio.engine.calibration.views.seen.tracks import Sample

_CAUCHY = 2.0
_BONE_M = 0.025
_LIMBS_SHARE = 1e-3
_OWN_FOCAL, _ALIKE_FOCAL, _COMMON_FOCAL = 0.12, 0.05, 0.20
"""Standard deviations of unknown focal lengths, as logarithms: of cameras from their mean; the same if all cameras
seem to be of one model; of the mean from the usual focal length."""
_SAME_SIZE = 1.02
_BEND = 0.05
_CENTRE_SHARE = 0.012
"""Deviation of the principal point from the picture's middle, as a share of the focal length."""
_ALIKE_S = 0.5
"""Correlation time of landmark errors: observations within it count as one against the priors."""
_AHEAD_S = 0.05
_BEHIND = 0.1
"""Residual of a landmark whose joint is behind the camera, as a share of the focal length."""


@dataclass(frozen=True)
class Freedom:
    """Unknowns besides places, joints and bones.

    Attributes:
        focals: by camera, the index of its unknown focal length, -1 = known; equal indices share one unknown.
        shares: by camera, relative deviation of its given focal length; 0 = not given, or given exactly.
        lenses: whether each camera's distortion and principal point are unknown.
        clocks: whether the clocks of all cameras but the first are unknown.
    """

    focals: tuple[int, ...]
    shares: tuple[float, ...]
    lenses: tuple[bool, ...]
    clocks: bool


@dataclass(frozen=True)
class FittedRig:
    """State of an adjustment.

    Attributes:
        rig: the cameras.
        joints: [m], in the first camera's frame, shape (instant_count, 17, 3); NaN = unknown.
        bones: lengths [m], shape (LENGTH_COUNT,).
        cost: the minimised cost.
        covariance: of the global unknowns, or None before the end.
        columns: of each camera's unknowns in the covariance, shape (camera_count, 11); -1 = known.
    """

    rig: CameraRig
    joints: Array
    bones: Array
    cost: float = np.inf
    covariance: Array | None = None
    columns: np.ndarray | None = None


def columns_of(freedom: Freedom) -> tuple[np.ndarray, int]:
    """Return the indices of each camera's unknowns, shape (camera_count, 11), -1 = known, and the number of all."""
    count = len(freedom.focals)
    out = np.full((count, UNKNOWNS), -1)
    out[1:, :6] = np.arange(6 * (count - 1)).reshape(count - 1, 6)
    used = 6 * (count - 1)
    for camera, number in enumerate(freedom.focals):
        out[camera, FOCAL] = used + number if number >= 0 else -1
    used += max(freedom.focals) + 1
    for camera in np.flatnonzero(freedom.lenses):
        out[camera, [BEND, *range(UNKNOWNS)[CENTRE]]] = used + np.arange(3)
        used += 3
    if freedom.clocks:
        out[1:, AHEAD] = used + np.arange(count - 1)
        used += count - 1
    return out, used


def repeated(times_s: Array) -> float:
    """Return the number of instants that count as one, because landmark errors are correlated."""
    step = float(np.median(np.diff(times_s))) if len(times_s) > 1 else _ALIKE_S
    return max(1.0, _ALIKE_S / max(step, 1e-3))


class Adjustment:
    """One bundle adjustment of samples of all cameras at common instants.

    Args:
        samples: by camera.
        times_s: the instants [s].
        usual: the rig that gives the means of the priors of focal lengths, distortion and clocks.
        limbs_m: sum of the limbs' lengths [m], which gives the scale.
        loose: factor of all errors, above 1 for first rounds.
    """

    def __init__(
        self,
        samples: list[Sample],
        times_s: Array,
        usual: CameraRig,
        freedom: Freedom,
        limbs_m: float,
        loose: float = 1.0,
    ) -> None:
        self.points = np.stack([s.points for s in samples])
        self.speed = np.stack([s.speed for s in samples])
        self.weight = np.stack([s.weight for s in samples]) / loose**2
        self.bone_weight = 1.0 / (_BONE_M * loose) ** 2
        self.usual, self.freedom, self.limbs_m = usual, freedom, limbs_m
        self.columns, self.unknowns = columns_of(freedom)
        self.known = np.zeros(self.weight.shape[1:], dtype=np.bool_)
        given = np.array(freedom.shares) > 0
        sought = usual.focals[(self.columns[:, FOCAL] >= 0) & ~given]
        alike = len(sought) > 0 and sought.max() < _SAME_SIZE * sought.min()
        self.own_focal = _ALIKE_FOCAL if alike else _OWN_FOCAL
        self.repeated = repeated(times_s)

    def run(self, fit: FittedRig, rounds: int, small: float) -> FittedRig:
        """Return the fit, with its covariance, after at most `rounds` rounds, or after the first that lowers the cost
        by less than the share `small`."""
        known = known_of(fit.joints)
        self.weight = np.where(known, self.weight, 0.0)
        self.known = known
        fit = replace(fit, joints=np.where(known[..., None], fit.joints, 0.0))
        fit, damping = replace(fit, cost=self.cost(fit)), 1e-3
        for _ in range(rounds):
            system = self._system(fit)
            before = fit.cost
            for _ in range(6):
                trial = self._step(fit, system, damping)
                if trial.cost < fit.cost:
                    fit, damping = trial, max(damping / 5, 1e-7)
                    break
                damping *= 6
            if before - fit.cost < small * before:
                break
        covariance = self.repeated * np.linalg.pinv(self._reduced(self._system(fit), 0.0)[0], hermitian=True)
        joints = np.where(known[..., None], fit.joints, np.nan)
        return replace(fit, joints=joints, covariance=covariance, columns=self.columns)

    def rests(self, fit: FittedRig) -> Array:
        """Return the residual of each landmark [pixel], shape (camera_count, instant_count, 17, 2)."""
        shown, front = fit.rig.show(fit.joints)
        rest = shown - self.points + self.speed * (fit.rig.ahead_s - self.usual.ahead_s)[:, None, None, None]
        behind = _BEHIND * fit.rig.focals[:, None, None, None]
        return np.where(front[..., None], rest, behind)

    def cost(self, fit: FittedRig) -> float:
        rest = self.rests(fit)
        landmarks = _cauchy((rest**2).sum(axis=-1) * self.weight).sum()
        bones = _cauchy(self._stretch(fit)[0] ** 2 * self.bone_weight)[self._whole()].sum()
        b, P = self._prior(fit)
        return float(landmarks + bones + b @ P @ b)

    def _whole(self) -> np.ndarray:
        """Return whether both ends of each bone are known, shape (instant_count, bone_count)."""
        return self.known[:, BONES[:, 0]] & self.known[:, BONES[:, 1]]

    def _stretch(self, fit: FittedRig) -> tuple[Array, Array]:
        """Return each bone's excess over its usual length [m], and its direction."""
        bone = fit.joints[:, BONES[:, 0]] - fit.joints[:, BONES[:, 1]]
        length = np.maximum(np.linalg.norm(bone, axis=2), 1e-3)
        return length - fit.bones[LENGTH_OF], bone / length[..., None]

    def _prior(self, fit: FittedRig) -> tuple[Array, Array]:
        """Return the deviation of the global unknowns from their priors, and its inverse covariance."""
        size = self.unknowns + LENGTH_COUNT
        b, P = np.zeros(size + 1), np.zeros((size + 1, size + 1))
        given = np.array(self.freedom.shares) > 0
        focals = np.unique(self.columns[~given, FOCAL][self.columns[~given, FOCAL] >= 0])
        count = len(focals)
        for camera, row in enumerate(self.columns):
            if row[FOCAL] >= 0:
                b[row[FOCAL]] = np.log(fit.rig.focals[camera] / self.usual.focals[camera])
                if given[camera]:
                    P[row[FOCAL], row[FOCAL]] = self.freedom.shares[camera] ** -2
            if row[BEND] >= 0:
                b[row[BEND]], P[row[BEND], row[BEND]] = fit.rig.bends[camera], _BEND**-2
                at = row[CENTRE]
                b[at], P[at, at] = fit.rig.centres[camera], (_CENTRE_SHARE * self.usual.focals[camera]) ** -2
            if row[AHEAD] >= 0:
                b[row[AHEAD]] = fit.rig.ahead_s[camera] - self.usual.ahead_s[camera]
                P[row[AHEAD], row[AHEAD]] = _AHEAD_S**-2
        if count:
            mean = np.full((count, count), 1.0 / count)
            P[np.ix_(focals, focals)] = (
                np.eye(count) - mean
            ) / self.own_focal**2 + mean / count / _COMMON_FOCAL**2
        P *= self.repeated
        b[-1] = fit.bones[LIMBS].sum() / self.limbs_m - 1.0
        P[-1, -1] = _LIMBS_SHARE**-2
        return b, P

    def _system(self, fit: FittedRig) -> tuple[Array, ...]:
        """Return the normal equations: frames' blocks, their coupling with the globals, the globals' block, and
        both right sides."""
        frames, joints = fit.joints.shape[:2]
        size = self.unknowns + LENGTH_COUNT
        own = np.zeros((frames, joints, 3, joints, 3))
        cross = np.zeros((frames, joints, 3, size + 1))  # the last column collects known parameters
        shared, b_own, b_shared = (
            np.zeros((size + 1, size + 1)),
            np.zeros((frames, joints, 3)),
            np.zeros(size + 1),
        )
        rest = self.rests(fit)
        blocks = np.zeros((frames, joints, 3, 3))
        for camera in range(len(self.points)):
            _, by_point, by_camera = fit.rig.changes(camera, fit.joints, self.speed[camera])
            r = rest[camera]
            w = self.weight[camera] / (1.0 + (r**2).sum(axis=-1) * self.weight[camera] / _CAUCHY**2)
            wp, wc = by_point * w[..., None, None], by_camera * w[..., None, None]
            flat = by_camera.reshape(-1, UNKNOWNS)
            blocks += np.swapaxes(wp, -1, -2) @ by_point
            b_own -= (wp * r[..., None]).sum(axis=-2)
            columns = self.columns[camera]
            cross[..., columns] += np.swapaxes(wp, -1, -2) @ by_camera
            shared[np.ix_(columns, columns)] += wc.reshape(-1, UNKNOWNS).T @ flat
            b_shared[columns] -= wc.reshape(-1, UNKNOWNS).T @ r.ravel()
        every = np.arange(joints)
        own[:, every, :, every, :] = np.swapaxes(blocks, 0, 1)
        self._add_bones(fit, own, cross, shared, b_own, b_shared)
        b, P = self._prior(fit)
        limbs = np.zeros(size + 1)
        limbs[self.unknowns + LIMBS] = 1.0 / self.limbs_m
        shared += np.outer(limbs, limbs) * P[-1, -1]
        b_shared -= limbs * P[-1, -1] * b[-1]
        shared[:-1, :-1] += P[:-1, :-1]
        b_shared[:-1] -= P[:-1, :-1] @ b[:-1]
        n = joints * 3
        return (
            own.reshape(frames, n, n), cross[..., :-1].reshape(frames, n, size), shared[:-1, :-1],
            b_own.reshape(frames, n), b_shared[:-1],
        )  # fmt: skip

    def _add_bones(
        self, fit: FittedRig, own: Array, cross: Array, shared: Array, b_own: Array, b_shared: Array
    ) -> None:
        stretch, way = self._stretch(fit)
        w = np.where(self._whole(), self.bone_weight, 0.0)
        w = w / (1.0 + stretch**2 * w / _CAUCHY**2)
        outer = way[..., :, None] * way[..., None, :] * w[..., None, None]
        for k, (a, b) in enumerate(BONES):
            own[:, a, :, a, :] += outer[:, k]
            own[:, b, :, b, :] += outer[:, k]
            own[:, a, :, b, :] -= outer[:, k]
            own[:, b, :, a, :] -= outer[:, k]
            column = self.unknowns + LENGTH_OF[k]
            pull = way[:, k] * w[:, k, None]
            cross[:, a, :, column] -= pull
            cross[:, b, :, column] += pull
            b_own[:, a] -= pull * stretch[:, k, None]
            b_own[:, b] += pull * stretch[:, k, None]
            shared[column, column] += w[:, k].sum()
            b_shared[column] += w[:, k] @ stretch[:, k]

    def _reduced(self, system: tuple[Array, ...], damping: float) -> tuple[Array, Array, Array, Array]:
        """Return the globals' equations with the frames eliminated, and the terms that restore the frames."""
        own, cross, shared, b_own, b_shared = system
        every = np.arange(own.shape[1])
        own = own.copy()
        diagonal = own[:, every, every]
        own[:, every, every] = diagonal * (1.0 + damping) + 1e-3
        right_sides = np.concatenate([cross, b_own[..., None]], axis=2)
        solved = np.asarray(np.linalg.solve(own, right_sides), dtype=np.float64)
        flat = cross.reshape(-1, cross.shape[2])
        reduced = shared - flat.T @ solved[..., :-1].reshape(flat.shape)
        right = b_shared - flat.T @ solved[..., -1].ravel()
        reduced = np.asarray((reduced + reduced.T) / 2, dtype=np.float64)
        reduced[np.diag_indices_from(reduced)] += damping * np.diag(shared) + 1e-9
        return reduced, right, solved[..., :-1], solved[..., -1]

    def _step(self, fit: FittedRig, system: tuple[Array, ...], damping: float) -> FittedRig:
        reduced, right, solved, free = self._reduced(system, damping)
        try:
            np.linalg.cholesky(reduced)
            step = np.linalg.solve(reduced, right)
        except np.linalg.LinAlgError:
            return replace(fit, cost=np.inf)
        joints = fit.joints + (free - solved @ step).reshape(fit.joints.shape)
        each = np.append(step, 0.0)[self.columns]
        out = FittedRig(fit.rig.changed(each), joints, fit.bones + step[self.unknowns :])
        return replace(out, cost=self.cost(out))


def _cauchy(squares: Array) -> Array:
    return _CAUCHY**2 * np.log1p(squares / _CAUCHY**2)
