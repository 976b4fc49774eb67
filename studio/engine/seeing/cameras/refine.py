"""Refinement of given cameras by the performer and the floor that they see.

Boards and tapes place cameras to some millimetres and tenths of a degree. At the performer that is one to several
centimetres between cameras, enough to separate a hand from the face that it touches. A part of the take is tracked
with the cameras as given; then cameras, poses and shape are fitted together (`bundle`). An uncertain result is
refused, and the cameras stay as given.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.model.calibration import Calibration, Performer
from studio.engine.model.cameras.depth import DepthCamera, DepthFrame
from studio.engine.model.frames import CameraFrame
from studio.engine.seeing.cameras.bundle import Bundled, Instant, bundled
from studio.engine.seeing.cameras.floors import floor_corners, floor_of
from studio.engine.seeing.fitting.chain import vector_of
from studio.engine.seeing.tracker.skeletons import frame_sets, points_frame, with_next
from studio.engine.seeing.tracker.tracker import Tracker

Array = NDArray[np.float64]
Tracked = Callable[[CameraFrame, Performer], None]

EVERY = 6
"""Step between the image sets that are used, because neighbours are alike."""
_GAP_NS = 500_000_000
"""Longest gap without a new search for the performer."""
_LEAST_INSTANTS, _LEAST_POINTS = 12, 60
"""Least number of instants in which a camera sees the performer, and of points in each."""
_APART_M = 0.015
"""Maximum distance between points of the performer as placed by the cameras from either half of the instants."""
_BLOCKS = 8
"""Number of blocks of instants; the halves are the even and the odd blocks."""
_RESIDUAL_M, _FLOOR_M = 0.03, 0.02
"""Maximum median distance of points from the body, and maximum distance of a camera's floor from the stage's."""
_MOST_M, _MOST_DEG = 0.05, 2.0
_LOOKED_AT = 50


@dataclass(frozen=True)
class CameraMove:
    """Movement [m] and turn [degrees] of a camera from its given pose."""

    metres: float
    degrees: float


@dataclass(frozen=True)
class RefinedCameras:
    """Result of a refinement.

    Attributes:
        calibration: with the refined cameras; unchanged if they were refused.
        moves: by camera; empty if the cameras were refused.
        refused: why, and what to do; None if they were not refused.
    """

    calibration: Calibration
    moves: dict[str, CameraMove]
    refused: str | None = None

    def line(self) -> str:
        """Return what was done, in one line."""
        if self.refused is not None:
            return f"none, they stay as given: {self.refused}"
        return ", ".join(
            f"{name} by {move.metres * 1e3:.1f} mm and {move.degrees:.2f} degrees"
            for name, move in self.moves.items()
        )


def refine_cameras(
    frames: Iterable[DepthFrame],
    cameras: dict[str, DepthCamera],
    calibration: Calibration,
    tracked: Tracked | None = None,
) -> RefinedCameras:
    """Return the refined cameras; clocks, and the stage's middle and direction, which no camera shows, do not change.

    Args:
        frames: of one or several parts of the take, of all cameras in order of stage time.
        cameras: intrinsics by name, of two cameras or more.
        calibration: places and clocks as given.
        tracked: receives each tracked frame of the camera `points`, and the current estimate of the performer.
    """
    names = list(cameras)
    given = np.stack([calibration.cameras[name].T_stage_camera for name in names])
    first: dict[str, DepthFrame] = {}
    instants, shape = _instants(frames, cameras, calibration, first, tracked)
    few = [name for k, name in enumerate(names) if _seen(instants, k) < _LEAST_INSTANTS]
    if shape is None or few:
        return RefinedCameras(
            calibration,
            {},
            f"{', '.join(few)} saw too little of the performer; record one who moves for some seconds in view of "
            "all cameras, or calibrate by a walk",
        )
    floors = [floor_of(first.values(), name, camera) for name, camera in cameras.items()]
    found = bundled(instants, shape, given, floors)
    moves = {name: _move(T, at) for name, T, at in zip(names, found.T_stage_camera, given, strict=True)}
    refused = _elsewhere(moves, found, floors) or _unsure(instants, shape, given, floors)
    if refused is not None:
        return RefinedCameras(calibration, {}, refused)
    placed = dict(zip(names, found.T_stage_camera, strict=True))
    return RefinedCameras(with_places(calibration, placed), moves)


def with_places(calibration: Calibration, T_stage_camera: dict[str, Array]) -> Calibration:
    """Return the calibration with new camera transforms."""
    placed = {
        name: replace(calibration.cameras[name], T_stage_camera=T) for name, T in T_stage_camera.items()
    }
    return replace(calibration, cameras=calibration.cameras | placed)


def _instants(
    frames: Iterable[DepthFrame],
    cameras: dict[str, DepthCamera],
    calibration: Calibration,
    first: dict[str, DepthFrame],
    tracked: Tracked | None,
) -> tuple[list[Instant], Array | None]:
    """Return poses and points of some instants, and the final estimate of the shape; add each camera's first image to
    `first`."""
    names = list(cameras)
    tracker = Tracker(cameras, {name: calibration.cameras[name].T_stage_camera for name in names})
    instants: list[Instant] = []
    shape, last_ns = None, 0
    for number, (images, following) in enumerate(with_next(frame_sets(frames, calibration, len(names)))):
        first.update({name: image for name, image in images.items() if name not in first})
        time_ns = max(image.device_time_ns for image in images.values())
        if time_ns - last_ns > _GAP_NS:
            tracker.forget_pose()
        last_ns = time_ns
        skeleton = tracker.track(images, following)
        if tracked is not None:
            tracked(points_frame(skeleton, number, calibration, names), tracker.performer)
        body = tracker.fitted()
        if body is None:
            continue
        shape = body.figure.shape
        if number % EVERY == 0:
            index = np.array([names.index(name) for name in images])
            instants.append(Instant(body.pose, body.points._replace(camera=index[body.points.camera])))
    return instants, shape


def _seen(instants: Sequence[Instant], camera: int) -> int:
    """Return the number of instants in which a camera sees enough of the performer."""
    return sum(int((instant.points.camera == camera).sum() >= _LEAST_POINTS) for instant in instants)


def _move(T: Array, given: Array) -> CameraMove:
    turn = vector_of(T[:3, :3] @ given[:3, :3].T)
    return CameraMove(float(np.linalg.norm(T[:3, 3] - given[:3, 3])), float(np.degrees(np.linalg.norm(turn))))


def _elsewhere(moves: dict[str, CameraMove], found: Bundled, floors: Sequence[Array | None]) -> str | None:
    """Return why a camera cannot be at or near its given pose; None if all can."""
    again = "measure the cameras again, or calibrate by a walk"
    rows = zip(moves.items(), *found, floors, strict=True)
    for (name, move), T, residual_m, floor in rows:
        if move.metres > _MOST_M or move.degrees > _MOST_DEG:
            return (
                f"{name} would move by {move.metres * 1e3:.0f} mm and {move.degrees:.1f} degrees (allowed: "
                f"{_MOST_M * 1e3:.0f} mm, {_MOST_DEG:g} degrees); {again}"
            )
        height_m = 0.0 if floor is None else float(np.abs(floor_corners(T, floor)[:, 2]).mean())
        for what, off_m, most_m in (
            (f"the floor of {name} is {{}} mm off the stage's", height_m, _FLOOR_M),
            (f"what {name} sees is {{}} mm off the body", float(residual_m), _RESIDUAL_M),
        ):
            if off_m > most_m:
                return f"{what.format(round(off_m * 1e3))} (allowed: {most_m * 1e3:.0f}); {again}"
    return None


def _unsure(
    instants: Sequence[Instant], shape: Array, given: Array, floors: Sequence[Array | None]
) -> str | None:
    """Return how much the halves of the instants differ, as a reason to refuse; None if they agree."""
    block = np.arange(len(instants)) * _BLOCKS // len(instants)
    halves = [
        bundled(
            [one for one, k in zip(instants, block, strict=True) if k % 2 == half], shape, given, floors
        ).T_stage_camera
        for half in (0, 1)
    ]
    apart_m = max(
        _apart_m(halves[0][list(pair)], halves[1][list(pair)], given[pair[0]], instants)
        for pair in combinations(range(len(given)), 2)
    )
    if apart_m <= _APART_M:
        return None
    return (
        f"two halves of what was looked at give cameras that are {apart_m * 1e3:.0f} mm apart (allowed: "
        f"{_APART_M * 1e3:.0f}); record a performer who moves in view of all cameras, or calibrate by a walk"
    )


def _apart_m(first: Array, second: Array, given: Array, instants: Sequence[Instant]) -> float:
    """Return the difference at the performer between two placements of a pair of cameras [m], each (2, 4, 4)."""
    points = np.concatenate([instant.points.places[::_LOOKED_AT] for instant in instants])
    own = transform_points(invert_transform(given), points)
    there = [transform_points(invert_transform(pair[1]) @ pair[0], own) for pair in (first, second)]
    return float(np.linalg.norm(there[0] - there[1], axis=1).mean())
