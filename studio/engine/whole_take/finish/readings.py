"""The cameras' measurements in a take's frames, with left and right corrected, weighed by the cameras' noise."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from studio.engine.model.joints import MIRROR
from studio.engine.whole_take.finish.contact.contacts import wander_of
from studio.engine.whole_take.finish.lost_limbs import far_limbs
from studio.engine.whole_take.finish.measurements import Measurements, NoiseScale, measure, swapped
from studio.engine.whole_take.finish.store import Store
from studio.engine.whole_take.finish.trajectory import Kinematics
from studio.engine.whole_take.finish.windows import WINDOW

CAMERA_FRAME_S = 1.0 / 30.0
"""Depth cameras' period."""

RAYS_WANDER = 0.2
"""Variance of the slow errors of joints that only rays place, relative to those of depth cameras."""


class Readings:
    """The cameras' measurements of a take, window by window.

    Attributes:
        first: the first solve's configurations, shape (frame_count, nq).
        far: its limbs that are far from the cameras' joints, shape (frame_count, 4).
        alike: correlation of noise between frames, as `NoiseScale.alike`; 1 before `weigh`.
    """

    def __init__(self, store: Store, kinematics: Kinematics, dt: float, reach: NDArray[np.float64]) -> None:
        """Read a take and find cameras that exchange left and right.

        Args:
            store: the take's steps.
            kinematics: of the performer's humanoid.
            dt: time between two frames [s].
            reach: of each canonical joint, as a share of the usual one, shape (21,).
        """
        self._store, self._kinematics, self._dt, self._reach = store, kinematics, dt, reach
        first: list[NDArray[np.float64]] = []
        exchanged: list[NDArray[np.bool_]] = []
        far: list[NDArray[np.bool_]] = []
        for begin in range(0, len(store), WINDOW):
            records = store.read(begin, min(begin + WINDOW, len(store)))
            first.append(records["q"])
            expected = kinematics.sites(records["q"])
            positions = records["positions"].astype(np.float64)
            cameras = store.camera_positions, store.depthless
            turned = swapped(positions, expected, *cameras)
            positions[turned] = positions[turned][:, MIRROR]
            far.append(far_limbs(positions, expected))
            seen = store.readings(begin, begin + len(records), dt)
            exchanged.append(swapped(seen.positions, expected, *cameras))
        self.first = np.concatenate(first)
        self._exchanged = np.concatenate(exchanged)  # frame and camera
        self.far = np.concatenate(far)
        self.alike = 1.0
        self._noise: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self._last: tuple[tuple[int, int], Measurements] | None = None  # the last window

    def lay_over(self, first: int, other: "Readings") -> None:
        """Read frames from `first` on from another stretch of the take, whose steps replace the store's."""
        rows = slice(first, first + len(other.first))
        self.first[rows], self.far[rows], self._exchanged[rows] = other.first, other.far, other._exchanged
        self._last = None

    def of(self, begin: int, end: int) -> Measurements:
        """Return the measurements in frames from `begin` up to, but not including, `end`."""
        if self._last is None or self._last[0] != (begin, end):
            exchanged = self._exchanged[begin:end]
            seen = self._store.readings(begin, end, self._dt)
            for by_joint in (seen.positions, seen.confidence, seen.behind_m):
                by_joint[exchanged] = by_joint[exchanged][:, MIRROR]
            found = measure(
                seen.positions, seen.confidence, seen.late,
                self._store.camera_positions, self._store.along_m, seen.behind_m,
            )  # fmt: skip
            found = found.followed(self._reach).alone_for_less(self._dt)
            if self._noise is not None:
                found = found.scaled(*self._noise)
            self._last = (begin, end), found
        return self._last[1]

    @property
    def wander(self) -> float:
        """Variance of the joints' slow errors relative to those of depth cameras."""
        return wander_of(self.alike) * (1.0 if self._store.sees_depth else RAYS_WANDER)

    def weigh(self, q: NDArray[np.float64], pieces: Iterable[tuple[int, int]]) -> None:
        """Estimate the cameras' noise, by which all measurements are weighed from then on.

        Args:
            q: configurations near the true ones, shape (frame_count, nq).
            pieces: begin and end of each piece of the take without a gap [frames].
        """
        lag = max(1, round(CAMERA_FRAME_S / self._dt))
        scale = NoiseScale(len(self._store.cameras))
        for first, last in pieces:
            for begin in range(first, last, WINDOW):
                rows = slice(begin, min(begin + WINDOW + lag, last))
                if rows.stop - begin > lag:
                    scale.add(self.of(begin, rows.stop), self._kinematics.sites(q[rows]), lag)
        self.alike = scale.alike()
        factor, spread = scale.factors()
        factor *= wander_of(self.alike)  # means over independent frames are more precise
        # Errors of landmarks last: the higher the frame rate, the less each frame says.
        often = np.nan_to_num(np.maximum(self._store.frames_within(CAMERA_FRAME_S), 1.0), nan=1.0)
        depthless = self._store.depthless
        factor[depthless] *= often[depthless, None, None]
        self._noise, self._last = (factor, spread), None
