"""Spans of a recording in which a camera's joints are away from the others'.

Blocks of 5 s show that a camera's joints shifted (`steadiness`). A span's first and last instants are change points
within the blocks at its ends: the split with the least sum of absolute deviations from either side. Source:
Killick, Fearnhead and Eckley, "Optimal detection of changepoints with a linear computational cost", Journal of the
American Statistical Association 107, 2012, section 2, for one change.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from studio.engine.calibration.quality.steadiness import MOVED_M, block_shifts, joint_median
from studio.engine.model.spans import Span

BLOCK_S = 5.0
_LEAST_JOINTS = 5
_LEAST_BLOCKS = 2


class Shifts:
    """Collects the cameras' distances from each other, block by block, and returns the spans; `add` in order of
    time."""

    def __init__(self, camera_count: int, moved_m: float = MOVED_M) -> None:
        self._count, self._moved_m = camera_count, moved_m
        self._blocks: list[tuple[float, dict[int, float]]] = []
        self._times: list[NDArray[np.float64]] = []
        self._vectors: list[NDArray[np.float64]] = []

    def add(self, positions: NDArray[np.float64], times_s: NDArray[np.float64]) -> None:
        """Add whole blocks.

        Args:
            positions: joints by camera in one frame, left and right corrected [m], shape (camera_count,
                instant_count, 21, 3); NaN = unseen.
            times_s: shape (instant_count,), increasing.
        """
        blocks = np.floor(times_s / BLOCK_S).astype(int)
        for block in np.unique(blocks):
            inside = blocks == block
            mine = positions[:, inside]
            self._blocks.append((float(block) * BLOCK_S, block_shifts(mine, self._moved_m)))
            self._times.append(times_s[inside])
            self._vectors.append(_vectors(mine))

    def spans(self) -> list[list[Span]]:
        """Return every camera's spans, in order of time."""
        if not self._blocks:
            return [[] for _ in range(self._count)]
        return [self._of(camera) for camera in range(self._count)]

    def steps(self) -> list[list[Span]] | None:
        """Return every camera's spans if a camera was moved once, in whole blocks; None if none was.

        A camera that was moved in the middle differs by half of the move before and after it, so no block shows which
        side is wrong.
        """
        found = [self._step(camera) for camera in range(self._count)]
        largest = max((step.metres for step in found if step is not None), default=0.0)
        if largest == 0.0:
            return None
        return [
            [step] if step is not None and (self._count == 2 or step.metres == largest) else []
            for step in found
        ]

    def _step(self, camera: int) -> Span | None:
        """Return the shorter side of the best split of all blocks, if its sides are `moved_m` apart."""
        blocks = [k for k, mine in enumerate(self._vectors) if np.isfinite(mine[camera]).any()]
        levels = np.array([np.nanmedian(self._vectors[k][camera], axis=0) for k in blocks])
        splits = range(_LEAST_BLOCKS, len(blocks) - _LEAST_BLOCKS + 1)
        if not splits:
            return None
        split = min(splits, key=lambda k: _scatter(levels[:k]) + _scatter(levels[k:]))
        before, after = np.median(levels[:split], axis=0), np.median(levels[split:], axis=0)
        metres = float(np.linalg.norm(after - before))
        if metres <= self._moved_m:
            return None
        at_s = self._blocks[blocks[split]][0]
        if 2 * split < len(blocks):
            return Span(self._blocks[blocks[0]][0], at_s, metres)
        return Span(at_s, None, metres)

    def _of(self, camera: int) -> list[Span]:
        far = np.array([shifts[camera] > self._moved_m for _, shifts in self._blocks])
        known = np.array([np.isfinite(mine[camera]).any() for mine in self._vectors])
        order = np.flatnonzero(known | far)
        out, k = [], 0
        while k < len(order):
            if not far[order[k]]:
                k += 1
                continue
            first = k
            while k < len(order) and far[order[k]]:
                k += 1
            out.append(self._span(camera, order, first, k))
        return out

    def _span(self, camera: int, order: NDArray[np.int64], first: int, end: int) -> Span:
        """Return the span of the blocks `order[first:end]`; its ends are searched in the adjacent blocks too."""
        inside = order[first:end]
        vectors = self._joined(self._vectors, inside, camera)
        level = np.median(vectors[np.isfinite(vectors).all(axis=1)], axis=0)
        before = order[max(first - 1, 0) : first + 1]
        times, around = self._joined(self._times, before), self._joined(self._vectors, before, camera)
        from_s = (
            float(times[0]) if first == 0 and not _begins(around, level) else _change(times, around, level)
        )
        metres = float(np.median([self._blocks[block][1][camera] for block in inside]))
        after = order[end - 1 : end + 1]
        times, around = self._joined(self._times, after), self._joined(self._vectors, after, camera)
        to_s = float(-_change(-times[::-1], around[::-1], level))
        last = end == len(order) and not _begins(around[::-1], level)
        return Span(from_s, None if last else to_s, metres, named=self._count > 2)

    @staticmethod
    def _joined(
        parts: list[NDArray[np.float64]], blocks: NDArray[np.int64], camera: int | None = None
    ) -> NDArray[np.float64]:
        return np.concatenate([parts[block] if camera is None else parts[block][camera] for block in blocks])


def _vectors(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the median vector of each camera's joints from the others' at each instant [m].

    Shape (camera_count, instant_count, 3); NaN where fewer than five joints can be compared.
    """
    out = np.full((*positions.shape[:2], 3), np.nan)
    for camera in range(len(positions)):
        others = np.delete(positions, camera, axis=0)
        if len(others):
            difference = positions[camera] - joint_median(others)
            enough = np.isfinite(difference).all(axis=2).sum(axis=1) >= _LEAST_JOINTS
            out[camera, enough] = np.nanmedian(difference[enough], axis=1)
    return out


def _scatter(vectors: NDArray[np.float64]) -> float:
    """Return the sum of the vectors' distances from their median [m]."""
    return float(np.linalg.norm(vectors - np.median(vectors, axis=0), axis=1).sum())


def _costs(vectors: NDArray[np.float64], level: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cost of a change from 0 to `level` before each instant, and after the last: (instant_count + 1,)."""
    still, shifted = np.linalg.norm(vectors, axis=1), np.linalg.norm(vectors - level, axis=1)
    return np.append(0.0, np.cumsum(still)) + np.append(np.cumsum(shifted[::-1])[::-1], 0.0)


def _begins(vectors: NDArray[np.float64], level: NDArray[np.float64]) -> bool:
    """Whether a shift begins within these instants, rather than before them."""
    return bool(np.argmin(_costs(vectors[np.isfinite(vectors).all(axis=1)], level)) > 0)


def _change(times_s: NDArray[np.float64], vectors: NDArray[np.float64], level: NDArray[np.float64]) -> float:
    """Return the first instant of a shift [s]."""
    known = np.isfinite(vectors).all(axis=1)
    split = int(np.argmin(_costs(vectors[known], level)))
    return float(times_s[known][min(split, int(known.sum()) - 1)])


def inside_any(spans: Sequence[Span], times_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which of the times lie in any of the spans."""
    out = np.zeros(len(times_s), dtype=bool)
    for span in spans:
        out |= span.contains(times_s)
    return out
