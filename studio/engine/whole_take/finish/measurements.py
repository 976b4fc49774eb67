"""Every camera's joints at their own times, each with the nearest output frame: the input of finishing."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from studio.engine.model.cameras.joint_noise import JOINT_FACTOR, LANDMARK_FACTOR, variances
from studio.engine.model.joints import JOINT_COUNT, MIRROR
from studio.engine.model.triangulation.rays import nearest_on_rays

SWAP_SHARE = 0.7
"""A camera's left and right are exchanged if that reduces the distance to the first solve to this share."""

ALIKE = 0.4
"""Variance of the noise's step between frames relative to that of the noise: 2 (1 - 0.8) for depth cameras at 30
Hz."""

CHI2_MEDIANS = np.array([0.455, 1.386])
DIRECTIONS = np.array([1.0, 2.0])
"""Medians of chi-square, and numbers of directions: along the ray, and across it."""

ALONG = 0
"""Index of the direction along the ray."""

LEAST_COUNT = 60
SHARE = 2.0
SCALE_RANGE = (1.0, 100.0)
"""Noise is estimated from at least this many frames. Noise that changes between frames counts by this factor more,
because it moves the body more. The variance relative to the usual is clamped to this range.
"""

SPREAD_RANGE = (0.5, 30.0)
"""Range of a joint's error variance relative to the usual."""


ALONE_S, ALONE_SHARE = 0.1, 0.1
"""Time within which no other camera sees the performer, and weight of a camera without depth then. Its errors, which
last for some tenths of a second, would otherwise set the body's distance: limbs bend so that a nearer body fits.
Relative to each other, its joints then count as a depth camera's: the ends of limbs, which bend most, less than the
trunk.
"""


@dataclass(frozen=True)
class Measurements:
    """Joints of all cameras over some frames; a camera's covariance is `axial` along its ray, `lateral` across.

    Attributes:
        positions: shape (frame_count, camera_count, 21, 3), stage frame [m]; 0 where unseen.
        rays: unit vectors from the camera to the joint, same shape.
        axial: inverse variance along the ray [1/m2], shape (frame_count, camera_count, 21); 0 where unseen.
        lateral: inverse variance across the ray, same shape.
        late: time of a camera's frame minus that of the output frame [frames], shape (frame_count, camera_count).
        depthless: cameras that see no depth, shape (camera_count,).
        sharper: factor of squared normalised differences relative to the inverse variances, shape (camera_count, 21).
            Noise that is correlated between frames carries less information than its deviation in one frame.
        behind_m: distances of joints behind the hips, guessed from the picture of a camera without depth [m], shape
            (frame_count, camera_count, 21); NaN = not guessed.
    """

    positions: NDArray[np.float64]
    rays: NDArray[np.float64]
    axial: NDArray[np.float64]
    lateral: NDArray[np.float64]
    late: NDArray[np.float64]
    depthless: NDArray[np.bool_]
    sharper: NDArray[np.float64]
    behind_m: NDArray[np.float64]

    def off(self, sites: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return measured minus solved joints, at the cameras' own times [m], shape (frame_count, camera_count, 21,
        3).

        Args:
            sites: the body's canonical joints in the output frames [m], shape (frame_count, 21, 3).
        """
        if len(sites) < 3:
            return self.positions - sites[:, None]
        late = self.late[:, :, None, None]
        velocity, bend = np.gradient(sites, axis=0), np.zeros_like(sites)
        bend[1:-1] = 0.5 * (sites[2:] - 2.0 * sites[1:-1] + sites[:-2])
        return self.positions - sites[:, None] - late * (velocity[:, None] + late * bend[:, None])

    def squared(self, difference: NDArray[np.float64]) -> NDArray[np.float64]:
        """Squared normalised differences of differences with shape (frame_count, camera_count, 21, 3); shape without
        the 3."""
        return self.sharper * self.squared_by_direction(difference).sum(axis=2)

    def squared_by_direction(self, difference: NDArray[np.float64]) -> NDArray[np.float64]:
        """Squared normalised differences along and across the rays, each by its own variance, shape (frame_count,
        camera_count, 2, 21).
        """
        along = np.einsum("tcja,tcja->tcj", difference, self.rays) ** 2
        across = np.einsum("tcja,tcja->tcj", difference, difference) - along
        return np.stack([self.axial * along, self.lateral * across], axis=2)

    def scaled(self, factor: NDArray[np.float64], spread: NDArray[np.float64]) -> "Measurements":
        """The measurements with variances along and across multiplied by `factor`, and squared differences normalised
        by variances times `spread`; shapes (camera_count, 2, 21).
        """
        share = DIRECTIONS[:, None] / DIRECTIONS.sum()
        return replace(
            self,
            axial=self.axial / factor[:, 0],
            lateral=self.lateral / factor[:, 1],
            sharper=self.sharper / (share * spread / factor).sum(axis=1),
        )

    def alone_for_less(self, frame_s: float) -> "Measurements":
        """The measurements with a camera without depth weighted by `ALONE_SHARE` where it alone sees the performer,
        and with guesses only there; `frame_s`: time between two frames [s]. The only camera of a take keeps its
        weight.
        """
        if not self.depthless.any() or len(self.depthless) < 2:
            return self
        span = 2 * round(ALONE_S / frame_s) + 1
        sees = maximum_filter1d(self.lateral.max(axis=2) > 0.0, span, axis=0)
        alone = (sees.sum(axis=1) == 1)[:, None] & self.depthless
        by_joint = (LANDMARK_FACTOR / JOINT_FACTOR) ** 2
        share = np.where(alone[:, :, None], ALONE_SHARE * by_joint, 1.0)
        return replace(
            self,
            axial=self.axial * share,
            lateral=self.lateral * share,
            behind_m=np.where(alone[:, :, None], self.behind_m, np.nan),
        )

    def followed(self, reach: NDArray[np.float64]) -> "Measurements":
        """The measurements with each joint's weight multiplied by `reach`, shape (21,), 1 = as usual, 0 = not
        used."""
        share = reach**2
        return replace(
            self,
            axial=self.axial * share,
            lateral=self.lateral * share,
            sharper=self.sharper / np.maximum(share, 1e-6),
        )


class NoiseScale:
    """Noise of each camera's joints in this take, relative to that of `model.joint_noise`.

    Noise is the movement of a camera's joint from one of its frames to the next that the smooth body does not make.
    Noise that is correlated between frames moves little; `ALIKE` corrects for that. The median is used, because of
    spikes.
    """

    def __init__(self, cameras: int) -> None:
        self._moves, self._offs = (_Medians((cameras, len(DIRECTIONS), JOINT_COUNT)) for _ in range(2))

    def add(self, measurements: Measurements, sites: NDArray[np.float64], lag: int) -> None:
        """Add the differences between cameras and body, and their changes over `lag` frames.

        Args:
            measurements: of some frames.
            sites: the body's canonical joints in them [m], shape (frame_count, 21, 3).
            lag: output frames per frame of a camera.
        """
        off = measurements.off(sites)
        seen = np.repeat((measurements.axial > 0.0)[:, :, None], len(DIRECTIONS), axis=2)
        seen[:, measurements.depthless, ALONG] = False
        self._offs.add(measurements.squared_by_direction(off), seen)
        moved = np.zeros_like(off)
        moved[lag:] = off[lag:] - off[:-lag]
        self._moves.add(measurements.squared_by_direction(moved)[lag:], seen[lag:] & seen[:-lag])

    def factors(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the factors of the variances: of weights, and of the test for outliers; shapes (camera_count, 2,
        21), 1 with too few frames.
        """
        usual = CHI2_MEDIANS[:, None]
        return (
            np.clip(np.nan_to_num(SHARE * self._moves.found() / (usual * ALIKE), nan=SHARE), *SCALE_RANGE),
            np.clip(np.nan_to_num(self._offs.found() / usual, nan=1.0), *SPREAD_RANGE),
        )

    def alike(self) -> float:
        """Return the correlation of noise between frames: 1 as with depth cameras or more, towards 0.2 for
        independent frames."""
        share = self._offs.found() * ALIKE / self._moves.found()
        known = share[np.isfinite(share)]
        return float(min(np.median(known), 1.0)) if len(known) else 1.0


def posture_share(alike: float) -> float:
    """Return the weight of the usual posture, 0..1: 1 for noise as correlated as that of depth cameras.

    The mean over frames of AR(1) noise with correlation r is as precise as that of (1 - r) / (1 + r) times as many
    independent frames, and the posture is weighed against those. The step of such noise has a variance of 2 (1 - r).
    """
    return alike * max(4.0 * alike / ALIKE - 1.0, 1.0) / (4.0 / ALIKE - 1.0)


class _Medians:
    """Medians of positive numbers, many at once, by histograms of their logarithms."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._edges = np.linspace(-8.0, 12.0, 201)
        self._counts = np.zeros((*shape, len(self._edges) - 1))

    def add(self, numbers: NDArray[np.float64], known: NDArray[np.bool_]) -> None:
        """Add the known numbers, shapes (frame_count, *shape)."""
        bins = np.digitize(np.log(np.maximum(numbers, 1e-9)), self._edges[1:-1])
        where = np.nonzero(known)[1:]
        np.add.at(self._counts, (*where, bins[known]), 1.0)

    def found(self) -> NDArray[np.float64]:
        """The medians; NaN where fewer than `LEAST_COUNT` were counted."""
        total = self._counts.sum(axis=-1)
        middle = 0.5 * (self._edges[1:] + self._edges[:-1])
        below = self._counts.cumsum(axis=-1) - 0.5 * self._counts
        out = np.full(total.shape, np.nan)
        for k in zip(*np.nonzero(total >= LEAST_COUNT), strict=True):
            out[k] = np.exp(np.interp(0.5 * total[k], below[k], middle))
        return out


def swapped(
    positions: NDArray[np.float64],
    expected: NDArray[np.float64],
    camera_positions: NDArray[np.float64],
    depthless: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return the frames in which a camera exchanges left and right, shape (frame_count, camera_count).

    Args:
        positions: shape (frame_count, camera_count, 21, 3) [m]; NaN = unseen.
        expected: the first solve's canonical joints [m], shape (frame_count, 21, 3).
        camera_positions: optical centres [m], shape (camera_count, 3).
        depthless: cameras whose joints are compared across their rays, shape (camera_count,).
    """

    def cost(joints: NDArray[np.float64]) -> NDArray[np.float64]:
        if depthless.any():
            joints = joints.copy()
            joints[:, depthless] = nearest_on_rays(
                joints[:, depthless], camera_positions[depthless], expected[:, None]
            )
        distance = np.minimum(np.linalg.norm(joints - expected[:, None], axis=3), 0.3)
        distance = np.where((MIRROR != np.arange(len(MIRROR))) & ~np.isnan(distance), distance, np.nan)
        count = (~np.isnan(distance)).sum(axis=2)
        return np.nansum(distance, axis=2) / np.maximum(count, 1)

    as_is, mirrored = cost(positions), cost(positions[:, :, MIRROR])
    return (mirrored < SWAP_SHARE * as_is) & (as_is > 0.06)


def measure(
    positions: NDArray[np.float64],
    confidence: NDArray[np.float64],
    late: NDArray[np.float64],
    camera_positions: NDArray[np.float64],
    along_m: NDArray[np.float64],
    behind_m: NDArray[np.float64] | None = None,
) -> Measurements:
    """Return the measurements of some frames, with the noise of `model.joint_noise`.

    Args:
        positions: shape (frame_count, camera_count, 21, 3), stage frame [m]; NaN = unseen.
        confidence: shape (frame_count, camera_count, 21).
        late: time after the output frame [frames], shape (frame_count, camera_count).
        camera_positions: optical centres [m], shape (camera_count, 3).
        along_m: standard deviation along the rays of cameras that see no depth [m], shape (camera_count,); NaN = of
            the others.
        behind_m: as in `Measurements`; None = nothing is guessed.
    """
    seen = ~np.isnan(positions[..., 0])
    positions = np.where(seen[..., None], positions, 0.0)
    rays, axial, lateral = variances(positions, confidence, camera_positions, along_m)
    guessed = np.full(seen.shape, np.nan) if behind_m is None else behind_m
    return Measurements(
        positions,
        rays,
        seen / axial,
        seen / lateral,
        late,
        ~np.isnan(along_m),
        np.ones(seen.shape[1:]),
        guessed,
    )
