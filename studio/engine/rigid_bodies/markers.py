"""Markers that another system tracks: named ones over a take, and the places of those without a name."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import msgspec
import numpy as np
from numpy.typing import NDArray

from studio.engine.model.frames import ClockModel
from studio.engine.model.rigid_body import PlacedMarkers
from studio.engine.rigid_bodies.known import BodyPlace
from studio.engine.rigid_bodies.reading import BodyAxes, points_to_stage_axes

MOST_MARKERS = 512
MOST_APART_S = 0.1
"""Markers are known within this time of a reading, and between readings at most twice this time apart."""

Place = tuple[float, float, float]


class MarkersReading(msgspec.Struct, frozen=True, array_like=True):
    """The markers of an instant, in the axes of their system.

    Attributes:
        names: names of the named ones, such as `Anna:LKNE`, each once.
        positions_m: their places [m].
        loose_m: places of markers without a name [m].
    """

    names: tuple[str, ...]
    positions_m: tuple[Place, ...]
    loose_m: tuple[Place, ...] = ()


def placed_markers(reading: MarkersReading, axes: BodyAxes, place: BodyPlace) -> PlacedMarkers:
    """Return the markers of an instant on the stage."""

    def on_stage(points: Sequence[Place]) -> NDArray[np.float64]:
        return place.moved_points(points_to_stage_axes(np.array(points, float).reshape(-1, 3), axes))

    return PlacedMarkers(on_stage(reading.positions_m), on_stage(reading.loose_m))


@dataclass(frozen=True)
class MarkerTracks:
    """Markers over a take, in axes with z up.

    Attributes:
        names: names of the named ones.
        time_s: stage time of each reading [s], shape (n,), increasing.
        positions_m: places of the named ones, shape (n, name_count, 3); NaN = not seen.
        loose_counts: number of markers without a name in each reading, shape (n,).
        loose_m: places of all of these, reading after reading, shape (sum of counts, 3).
    """

    names: tuple[str, ...] = ()
    time_s: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    positions_m: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 0, 3), np.float32))
    loose_counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    loose_m: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 3), np.float32))

    def placed(self, place: BodyPlace, later_s: float = 0.0) -> "MarkerTracks":
        """Return them in the stage frame, with later times."""
        named = place.moved_points(self.positions_m.reshape(-1, 3).astype(float)).reshape(
            self.positions_m.shape
        )
        loose = place.moved_points(self.loose_m.astype(float))
        return MarkerTracks(
            self.names,
            self.time_s + later_s,
            named.astype(np.float32),
            self.loose_counts,
            loose.astype(np.float32),
        )

    def at(self, time_s: float) -> PlacedMarkers | None:
        """Return the markers of the reading nearest to a stage time [s]; None if none is near."""
        if not len(self.time_s):
            return None
        k = int(np.abs(self.time_s - time_s).argmin())
        if abs(self.time_s[k] - time_s) > MOST_APART_S:
            return None
        named = self.positions_m[k].astype(float)
        begin = int(self.loose_counts[:k].sum())
        loose = self.loose_m[begin : begin + int(self.loose_counts[k])].astype(float)
        return PlacedMarkers(named[np.isfinite(named).all(axis=1)], loose)

    def of_asset(self, asset: str) -> "MarkerTracks":
        """Return the markers of one asset alone, by the name before the colon."""
        kept = [k for k, name in enumerate(self.names) if name.rpartition(":")[0] == asset]
        names = tuple(self.names[k] for k in kept)
        return MarkerTracks(names, self.time_s, self.positions_m[:, kept], self.loose_counts, self.loose_m)

    def on_grid(self, rate_hz: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return even times [s], shape (m,), and places at them, shape (m, name_count, 3); NaN = not seen."""
        grid_s = np.arange(self.time_s[0], self.time_s[-1], 1.0 / rate_hz)
        places = np.full((len(grid_s), len(self.names), 3), np.nan)
        for k in range(len(self.names)):
            seen = np.isfinite(self.positions_m[:, k]).all(axis=1)
            times_s, mine = self.time_s[seen], self.positions_m[seen, k].astype(float)
            if len(times_s) < 2:
                continue
            after = np.clip(np.searchsorted(times_s, grid_s), 1, len(times_s) - 1)
            known = times_s[after] - times_s[after - 1] <= 2 * MOST_APART_S
            known &= (grid_s >= times_s[0]) & (grid_s <= times_s[-1])
            between = np.stack([np.interp(grid_s, times_s, column) for column in mine.T], axis=1)
            places[known, k] = between[known]
        return grid_s, places


class MarkerGatherer:
    """Puts the readings of a take together, one after the other."""

    def __init__(self) -> None:
        self._columns: dict[str, int] = {}
        self._known: dict[tuple[str, ...], NDArray[np.int64]] = {}
        self._readings: list[tuple[int, NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]] = []

    def add(self, time_ns: int, axes: BodyAxes, reading: MarkersReading) -> None:
        """Add a reading that arrived at a time on the server's clock [ns]."""
        columns = self._known.get(reading.names)
        if columns is None:
            new = [self._columns.setdefault(name, len(self._columns)) for name in reading.names]
            columns = self._known[reading.names] = np.array(new, np.int64)
        named, loose = (
            points_to_stage_axes(np.array(points, float).reshape(-1, 3), axes).astype(np.float32)
            for points in (reading.positions_m, reading.loose_m)
        )
        self._readings.append((time_ns, columns, named, loose))

    def tracks(self, server_to_stage: ClockModel | None) -> MarkerTracks:
        """Return the markers on the stage clock; none without a clock."""
        if server_to_stage is None or not self._readings:
            return MarkerTracks()
        times = np.array([server_to_stage.stage_ns(one[0]) * 1e-9 for one in self._readings])
        order = np.argsort(times, kind="stable")
        order = order[np.concatenate([[True], np.diff(times[order]) > 0])]
        positions = np.full((len(order), len(self._columns), 3), np.nan, np.float32)
        for row, k in enumerate(order.tolist()):
            _, columns, named, _ = self._readings[k]
            positions[row, columns] = named
        loose = [self._readings[k][3] for k in order.tolist()]
        return MarkerTracks(
            tuple(self._columns),
            times[order],
            positions,
            np.array([len(one) for one in loose], np.int64),
            np.concatenate([np.empty((0, 3), np.float32), *loose]),
        )
