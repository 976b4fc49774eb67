"""Cameras' frames as rows of the solve, with left and right corrected and outliers rejected.

A joint too far from the body's prediction is rejected (an outlier). It is accepted again when it stays there, so that
no limb is lost for good. The weight of the others falls with their residual (Cauchy, reweighted in every iteration).
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.cameras.joint_noise import informations
from studio.engine.model.frames import Reading
from studio.engine.model.joints import JOINT_COUNT, MIRROR
from studio.engine.model.triangulation.rays import FREE_M
from studio.engine.solve.kalman.kernels import mean_distances, middles, on_expected, pulled, ray_middles

Array = NDArray[np.float64]

GATE = 30.0
"""Validation gate: squared Mahalanobis distance from the prediction beyond which a joint is rejected."""

CAUCHY = 3.0
"""Residual in standard deviations from which the weight falls."""

INFLATION = 3.0
"""A camera's noise is correlated from frame to frame: each frame carries this much less information than its
covariance says.
"""

INSIST_S = 0.4
"""A joint that all cameras report away from its prediction for this long is accepted."""

LOST_SHARE, LEAST_LOST, LOST_S = 0.5, 4, 0.1
"""If more than this share of the joints, and this many, are rejected for this long, the performer is elsewhere."""

SWAP_SHARE, SWAP_M = 0.7, 0.06
"""Left and right are exchanged if that reduces the joints' distance to this share, and the distance exceeds this."""

MOST_GUESSED_M = 0.1
"""Largest difference between a depth guessed from one picture and the expected one; beyond it, it is clipped."""

_PAIRED = np.flatnonzero(MIRROR != np.arange(JOINT_COUNT))
_MIRRORED = MIRROR[_PAIRED]


class ReadingRows:
    """Joints of one or more readings at one instant.

    Attributes:
        positions: shape (reading_count, 21, 3), stage frame [m]; 0 where unseen.
        seen: shape (reading_count, 21).
        used: joints that are not rejected.
        information: inverse covariance [1/m2], shape (reading_count, 21, 3, 3); 0 where unseen or rejected.
    """

    def __init__(
        self, positions: Array, information: Array, reach: Array, *, depthless: bool = False
    ) -> None:
        """Keep the rows.

        Args:
            positions: NaN = unseen.
            information: of seen and unseen joints.
            reach: weight of each joint, 0..1, shape (21,).
            depthless: some readings are of cameras that see no depth.
        """
        self._depthless = depthless
        self.seen = ~np.isnan(positions[:, :, 0]) & (reach > 0.0)
        self.positions = np.where(self.seen[:, :, None], positions, 0.0)
        self.information = information * (self.seen * reach**2)[:, :, None, None]
        self.used = self.seen

    def use(self, used: NDArray[np.bool_]) -> None:
        """Reject all joints but these, shape (reading_count, 21)."""
        self.used = used
        self.information = self.information * used[:, :, None, None]

    def possible(self, expected: Array, spread: Callable[[], Array]) -> NDArray[np.bool_]:
        """Return the joints within the validation gate `GATE`, shape (reading_count, 21).

        Args:
            expected: shape (21, 3) [m].
            spread: returns the covariance of the prediction [m2], shape (21, 3, 3); called only where needed.
        """
        near = pulled(self.positions, self.information, expected, CAUCHY)[3] < GATE
        if near.all():
            return near
        c, j = np.nonzero(~near)
        total = np.linalg.inv(self.information[c, j]) + spread()[j]
        off = (self.positions - expected)[c, j]
        near[c, j] = np.einsum("na,na->n", off, np.linalg.solve(total, off[..., None])[..., 0]) < GATE
        return near

    def pull(self, joints: Array) -> tuple[Array, Array, Array]:
        """Return the information of the rows on a pose's joints, shape (21, 3).

        Returns:
            Information [1/m2], shape (21, 3, 3), pull [1/m], shape (21, 3), and the weight of each row, 0..1,
            shape (reading_count, 21).
        """
        return pulled(self.positions, self.information, joints, CAUCHY)[:3]

    def middle(self) -> tuple[Array, Array]:
        """Weighted means of the used joints, shape (21, 3), NaN where there is none; and 1 / their standard
        deviations [1/m], shape (21,), 0 where there is none.
        """
        return (ray_middles if self._depthless else middles)(self.positions, self.information)


class Gate:
    """Makes rows of readings, and keeps the time for which each joint has been rejected."""

    def __init__(self, reach: Array) -> None:
        self._reach = reach
        self._left_out_s = np.zeros(JOINT_COUNT)
        self.exchanged = np.zeros(0, dtype=bool)

    def forget(self) -> None:
        """Reset."""
        self._left_out_s[:] = 0.0

    def rows(
        self,
        readings: Sequence[Reading],
        camera_positions: Array,
        expected: Array,
        velocities: Array,
        at_s: float,
    ) -> ReadingRows:
        """Return the rows of readings at one instant.

        Args:
            readings: at most a few per camera.
            camera_positions: optical centres [m], shape (camera_count, 3).
            expected: predictions of the joints at that instant [m], shape (21, 3).
            velocities: their velocities [m/s], shape (21, 3).
            at_s: the instant, on the clock of the readings' offsets [s].
        """
        if len(self.exchanged) != len(camera_positions):
            self.exchanged = np.zeros(len(camera_positions), dtype=bool)
        positions = np.array([r.positions for r in readings])
        confidence = np.array([r.confidence for r in readings])
        cameras = np.array([r.camera for r in readings])
        along_m = np.array([np.nan if r.along_m is None else r.along_m for r in readings])
        late = np.array([r.offset_s for r in readings]) - at_s
        moved, centres = late[:, None, None] * velocities, camera_positions[cameras]
        depthless = ~np.isnan(along_m)
        positions -= moved
        for row, exchanged in enumerate(_exchanged(positions, expected, centres, depthless)):
            self.exchanged[cameras[row]] = exchanged
            if exchanged:
                positions[row], confidence[row] = positions[row][MIRROR], confidence[row][MIRROR]
        if depthless.any():
            most = np.where(along_m < FREE_M, MOST_GUESSED_M, 0.0)
            positions += moved
            on_expected(positions, centres, expected + moved, along_m, most)
            positions -= moved
        seen = np.where(np.isnan(positions), 0.0, positions)
        known = informations(seen, confidence, centres, along_m) / INFLATION
        return ReadingRows(positions, known, self._reach, depthless=bool(depthless.any()))

    def choose(
        self, rows: ReadingRows, expected: Array, spread: Callable[[], Array], dt: float
    ) -> NDArray[np.bool_]:
        """Reject outlier rows; return the joints that are accepted again, shape (21,).

        Args:
            rows: changed in place.
            expected: shape (21, 3) [m].
            spread: returns the covariance of the prediction [m2], shape (21, 3, 3).
            dt: time since the last rows [s].
        """
        possible = rows.possible(expected, spread)
        accepted = (rows.seen & possible).any(axis=0)
        out = rows.seen & ~possible
        if not out.any():
            self._left_out_s[accepted] = 0.0
            return np.zeros(JOINT_COUNT, dtype=bool)
        self._left_out_s = np.where(accepted, 0.0, self._left_out_s + dt * out.any(axis=0))
        insists = self._left_out_s > INSIST_S
        self._left_out_s[insists] = 0.0
        rows.use(rows.seen & (possible | insists))
        return insists

    def lost(self, seen: NDArray[np.bool_]) -> bool:
        """Whether most of the joints seen, shape (21,), have been rejected for a while: the performer is
        elsewhere."""
        out = int((seen & (self._left_out_s > LOST_S)).sum())
        return out >= LEAST_LOST and out > LOST_SHARE * int(seen.sum())


def _exchanged(
    positions: Array, expected: Array, centres: Array, depthless: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Readings with left and right exchanged, shape (reading_count,); see `mean_distances`."""
    as_is = mean_distances(positions, expected, _PAIRED, _PAIRED, centres, depthless)
    far = as_is > SWAP_M
    if not far.any():
        return far
    return far & (
        mean_distances(positions, expected, _MIRRORED, _PAIRED, centres, depthless) < SWAP_SHARE * as_is
    )
