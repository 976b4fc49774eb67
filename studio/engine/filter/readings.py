"""Cameras' frames as rows of the solve: left and right put right, and what cannot be left out.

A joint too far from where the body can have it is left out (an outlier). It is believed again when it insists, so
that no limb is lost for good. What remains counts less the further it is off (Cauchy, reweighted in every iteration).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.frames import Reading
from studio.engine.fusion.noise import covariances
from studio.engine.joints import JOINT_COUNT, MIRROR

Array = NDArray[np.float64]

GATE = 60.0
"""Squared Mahalanobis distance from where the body is expected beyond which a joint is left out."""

CAUCHY = 3.0
"""Deviations beyond this many sigma count less and less."""

INFLATION = 3.0
"""A camera's noise is alike from frame to frame: each frame tells this much less than its covariance says."""

INSIST_S = 0.4
"""A joint that a camera reports off its expected place for this long is believed again."""

SWAP_SHARE, SWAP_M = 0.7, 0.06
"""Left and right are exchanged where that brings joints this much nearer, and they are this far off."""

_PAIRED = np.flatnonzero(MIRROR != np.arange(JOINT_COUNT))
_UNSEEN_VARIANCE = 1e6


class Rows:
    """Joints of one or more readings, brought to one instant.

    Attributes:
        positions: shape (reading_count, 21, 3), stage frame [m]; 0 where unseen.
        seen: shape (reading_count, 21).
        used: those that are not left out.
        covariance: [m2], shape (reading_count, 21, 3, 3).
    """

    def __init__(self, positions: Array, covariance: Array, reach: Array) -> None:
        """`reach`: how strongly each joint is followed, 0..1, shape (21,)."""
        self.seen = ~np.isnan(positions[:, :, 0]) & (reach > 0.0)
        self.positions = np.where(self.seen[:, :, None], positions, 0.0)
        covariance = covariance / np.maximum(reach, 1e-3)[:, None, None] ** 2
        self.covariance = np.where(self.seen[:, :, None, None], covariance, _UNSEEN_VARIANCE * np.eye(3))
        self.used = self.seen
        self._information = np.linalg.inv(self.covariance)

    def use(self, used: NDArray[np.bool_]) -> None:
        """Leave out all but these, shape (reading_count, 21)."""
        self.used = used
        self._information = self._information * used[:, :, None, None]

    def distances(self, expected: Array, spread: Array) -> Array:
        """Squared Mahalanobis distances, shape (reading_count, 21), from joints of this covariance, (21, 3, 3)."""
        off = self.positions - expected
        away = np.linalg.solve(self.covariance + spread, off[..., None])[..., 0]
        return np.where(self.seen, np.einsum("cja,cja->cj", off, away), 0.0)

    def pull(self, joints: Array) -> tuple[Array, Array]:
        """Return the joints' information [1/m2], shape (21, 3, 3), and their pull [1/m], shape (21, 3), at a pose."""
        off = self.positions - joints
        pull = np.matmul(self._information, off[..., None])[..., 0]
        share = 1.0 / (1.0 + np.einsum("cja,cja->cj", off, pull) / CAUCHY**2)
        if len(off) == 1:
            return share[0, :, None, None] * self._information[0], share[0, :, None] * pull[0]
        return (
            np.einsum("cj,cjab->jab", share, self._information),
            np.einsum("cj,cja->ja", share, pull),
        )

    def middle(self) -> tuple[Array, Array]:
        """Weighted means of the joints seen, left out or not, shape (21, 3), NaN where unseen; and 1 / their
        deviations [1/m], shape (21,), 0 where unseen."""
        weight = np.where(self.seen, 3.0 / np.trace(self.covariance, axis1=2, axis2=3), 0.0)
        total = weight.sum(axis=0)
        mean = np.einsum("cj,cja->ja", weight, self.positions)
        return mean / np.where(total > 0.0, total, np.nan)[:, None], np.sqrt(total)


class Gate:
    """Makes rows of readings, and remembers for how long each camera's joints have been left out."""

    def __init__(self, reach: Array) -> None:
        self._reach = reach
        self._left_out_s = np.zeros((0, JOINT_COUNT))
        self._last_s = np.zeros(0)
        self.exchanged = np.zeros(0, dtype=bool)

    def forget(self) -> None:
        """Begin anew."""
        self._left_out_s = np.zeros((0, JOINT_COUNT))

    def rows(
        self,
        readings: Sequence[Reading],
        camera_positions: Array,
        expected: Array,
        velocities: Array,
        at_s: float,
    ) -> Rows:
        """Return the rows of readings at one instant.

        Args:
            readings: at most a few per camera.
            camera_positions: optical centres [m], shape (camera_count, 3).
            expected: where the body's joints are expected at that instant [m], shape (21, 3).
            velocities: and how they move [m/s], shape (21, 3).
            at_s: the instant, on the clock of the readings' offsets [s].
        """
        self._prepare(len(camera_positions))
        positions = np.array([r.positions for r in readings])
        confidence = np.array([r.confidence for r in readings])
        cameras = np.array([r.camera for r in readings])
        late = np.array([r.offset_s for r in readings]) - at_s
        positions -= late[:, None, None] * velocities
        for row, exchanged in enumerate(_exchanged(positions, expected)):
            self.exchanged[cameras[row]] = exchanged
            if exchanged:
                positions[row], confidence[row] = positions[row][MIRROR], confidence[row][MIRROR]
        seen = np.where(np.isnan(positions), 0.0, positions)
        noise = INFLATION * covariances(seen, confidence, camera_positions[cameras])
        return Rows(positions, noise, self._reach)

    def _prepare(self, cameras: int) -> None:
        if len(self._left_out_s) != cameras:
            self._left_out_s = np.zeros((cameras, JOINT_COUNT))
            self.exchanged = np.zeros(cameras, dtype=bool)

    def choose(
        self, rows: Rows, cameras: NDArray[np.int64], expected: Array, spread: Array, dt: float
    ) -> NDArray[np.bool_]:
        """Leave out rows that cannot be; return which joints are believed again, shape (21,).

        Args:
            rows: changed in place.
            cameras: camera of each reading, shape (reading_count,).
            expected: shape (21, 3) [m].
            spread: covariance of what is expected [m2], shape (21, 3, 3).
            dt: time since the last rows [s].
        """
        self._prepare(max(int(cameras.max()) + 1, len(self._left_out_s)))
        possible = rows.distances(expected, spread) < GATE
        out = rows.seen & ~possible
        if not out.any() and not self._left_out_s.any():
            return np.zeros(JOINT_COUNT, dtype=bool)
        since = np.where(out, self._left_out_s[cameras] + dt, 0.0)
        since = np.where(rows.seen, since, self._left_out_s[cameras])
        insists = out & (since > INSIST_S)
        self._left_out_s[cameras] = np.where(insists, 0.0, since)
        rows.use(rows.seen & (possible | insists))
        return insists.any(axis=0)


def _exchanged(positions: Array, expected: Array) -> NDArray[np.bool_]:
    """Which readings have left for right, shape (reading_count,)."""
    both = np.stack([positions[:, _PAIRED], positions[:, MIRROR[_PAIRED]]])
    distance = np.sqrt(np.square(both - expected[_PAIRED]).sum(axis=3))
    known = ~np.isnan(distance)
    distance = np.where(known, np.minimum(distance, 0.3), 0.0)
    as_is, mirrored = distance.sum(axis=2) / np.maximum(known.sum(axis=2), 1)
    return (mirrored < SWAP_SHARE * as_is) & (as_is > SWAP_M)
