"""Making of point clouds: takes are opened, images read, thinned to the budget, placed and coloured."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import StudioError
from studio.engine.base.files import file_stamp
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.frames import StepResult
from studio.engine.model.joints import OUTPUT_OF_CANONICAL_INDEX
from studio.take.raw.depth import DepthRecording
from studio.web.points.colours import by_confidence
from studio.web.points.replayed import ReplayedDepth, TakeDepth
from studio.web.points.seen import DepthImages, DepthSeen, NoDepth
from studio.web.points.thinning import StageSpace, Thinner
from studio.web.scene.clouds import ORIGIN_M, Cloud
from studio.worker import Stopped, run_in_process

_log = logging.getLogger(__name__)

RATE_HZ = 20.0
"""Maximum rate of clouds."""

BUDGET_BYTES_S = 2_160_000
"""Maximum rate of points to a browser [bytes/s]: what a tablet on a usual wireless network takes with the poses."""

COLOURS: dict[str, int] = {"camera": 6, "confidence": 9}
"""Choices of colour, and the bytes of a point: three coordinates of 16 bits, and maybe its own colour."""

MARGIN_M = 0.3


@dataclass(frozen=True, eq=False)
class Step:
    """The source of clouds: a replayed take or None for the live stage, and the step that is drawn with it."""

    depth: ReplayedDepth | None
    result: StepResult | None


def points_each(colour: str, cameras: int) -> int:
    """Return the maximum number of points of each of `cameras` cameras, in a colour of `COLOURS`."""
    return int(BUDGET_BYTES_S / RATE_HZ / COLOURS[colour] / max(cameras, 1))


class Maker:
    """Opens takes, and makes clouds from images; used by the thread only."""

    def __init__(self) -> None:
        self._index: tuple[object, DepthRecording | None] | None = None
        self._opened: tuple[ReplayedDepth, TakeDepth] | None = None
        self._thinners: dict[DepthCamera, Thinner] = {}
        self._made: dict[str, tuple[tuple[object, ...], Cloud]] = {}

    def has(self, depth: ReplayedDepth) -> bool:
        """Whether a take is open."""
        return self._opened is not None and self._opened[0] is depth

    def open(self, depth: ReplayedDepth, should_stop: Callable[[], bool]) -> DepthImages | None:
        """Return a take's images, None if they cannot be read. Another process indexes the file, reading all of it.

        Raises:
            Stopped: `should_stop` returned true.
        """
        if not depth.raw_path.is_file():
            return NoDepth()
        if self._opened is None or self._opened[0] is not depth:
            self.close()
            index = self._indexed(depth.raw_path, should_stop)
            if index is None:
                return None
            self._opened = depth, TakeDepth(index, depth.placed)
        return self._opened[1]

    def _indexed(self, path: Path, should_stop: Callable[[], bool]) -> DepthRecording | None:
        """Return the index of a file, None if it cannot be read; the last result is cached, also None."""
        key = path, file_stamp(path)
        if self._index is None or self._index[0] != key:
            self._index = key, None
            try:
                index = run_in_process("studio.take.raw.depth:index_depth", path, should_stop=should_stop)
            except Stopped:
                self._index = None
                raise
            except StudioError as error:
                _log.warning("no point clouds: %s", error)
                return None
            if index.cameras or index.problem is None:
                self._index = key, index
        return self._index[1]

    def make(
        self, images: DepthImages, shown: list[str], step: Step, colour: str
    ) -> tuple[dict[str, Cloud], dict[str, str]]:
        """Return clouds by camera, and why a camera has none."""
        time_s = 0.0 if step.result is None else step.result.frame_set.stage_time_ns * 1e-9
        seen = {name: images.at(name, time_s) for name in shown}
        says = {name: one for name, one in seen.items() if isinstance(one, str)}
        found = {name: one for name, one in seen.items() if isinstance(one, DepthSeen)}
        count = points_each(colour, len(found))
        joints, confidence = _body(step.result)
        near = None if step.result is None else StageSpace.about(_anybody(step.result), MARGIN_M)
        made = {}
        for name, one in found.items():
            solved = step if colour == "confidence" and step.depth is not None else None
            of = (step.depth, solved, one.key, one.camera, colour, count)
            if name not in self._made or self._made[name][0] != of:
                thinner = self._thinners.get(one.camera)
                if thinner is None:
                    thinner = self._thinners[one.camera] = Thinner(one.camera)
                points = thinner.points(one.depth_mm, one.T_stage_camera, count, near)
                colours = by_confidence(points, joints, confidence) if colour == "confidence" else None
                points -= ORIGIN_M.astype(np.float32)
                self._made[name] = of, Cloud(points.astype(np.float16), colours)
            made[name] = self._made[name][1]
        return made, says

    def close(self) -> None:
        """Close the take."""
        self._made.clear()
        if self._opened is not None:
            self._opened[1].close()
        self._opened = None


def _body(result: StepResult | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the solve's canonical joints, shape (21, 3), NaN without a body, and their confidence (21,)."""
    if result is None:
        return np.zeros((0, 3)), np.zeros(0)
    return result.positions_m[OUTPUT_OF_CANONICAL_INDEX], result.confidence[OUTPUT_OF_CANONICAL_INDEX]


def _anybody(result: StepResult) -> NDArray[np.float64]:
    """Return joints of the performer, shape (N, 3): of the solve, else those that cameras saw."""
    solved = result.positions_m[OUTPUT_OF_CANONICAL_INDEX]
    return solved if np.isfinite(solved).any() else result.frame_set.positions.reshape(-1, 3)
