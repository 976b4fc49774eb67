"""Camera poses refined on the tracked body and on the floor.

Skeletons of single cameras place the cameras only to a few centimetres, because each camera's joints have their own
errors. One body is therefore fitted to all cameras' points. Each camera is moved until its points lie on that body
and its floor on the stage's; then the body is fitted again.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import make_transform, rotation_between, transform_points
from studio.engine.base.sentences import Said, say
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.cameras.depth import DepthCamera, DepthFrame
from studio.engine.seeing.cameras.floors import floor_corners, floor_of
from studio.engine.seeing.fitting.chain import rotation_of
from studio.engine.seeing.tracker.skeletons import frame_sets, with_next
from studio.engine.seeing.tracker.tracker import Tracker

Array = NDArray[np.float64]

_ROUNDS = 3
MOST_SETS = 150
"""Largest number of instants used."""
_EVERY = 3
"""Step between the image sets that are used, because neighbours are alike."""
_REACH_M = 0.05
_LEAST_PAIRS = 2000
_GOOD_M, _USABLE_M = 0.015, 0.03
_FLOOR_WEIGHT = 0.05
"""Weight of a corner of the floor, as a share of the weight of all points of a camera."""
_SPREAD_REASONS = {
    "verdict.few_pairs", "verdict.few_pairs_seen", "verdict.halves_differ", "verdict.little_spread"
}  # fmt: skip
"""Codes of the reasons for refusing a calibration by skeletons that the body and the floor can correct."""


def refine_camera_poses(
    frames: Sequence[DepthFrame], cameras: dict[str, DepthCamera], calibration: Calibration
) -> Calibration:
    """Return the calibration with its cameras' poses refined; clocks do not change.

    Args:
        frames: of all cameras in order of stage time.
        cameras: intrinsics by name.
        calibration: first poses, and clocks.
    """
    floors = {name: floor_of(frames, name, camera) for name, camera in cameras.items()}
    residuals: dict[str, float] = {}
    for _ in range(_ROUNDS):
        calibration = _level(calibration, floors)
        pairs = _pairs(frames, cameras, calibration)
        placed = dict(calibration.cameras)
        for index, name in enumerate(cameras):
            own = pairs.get(index)
            if own is None or len(own[0]) < _LEAST_PAIRS:
                continue
            residuals[name] = float(np.median(np.abs(((own[1] - own[0]) * own[2]).sum(axis=1))))
            if name != calibration.reference:
                move = _move(*own, placed[name].T_stage_camera, floors[name])
                placed[name] = replace(placed[name], T_stage_camera=move @ placed[name].T_stage_camera)
        calibration = replace(calibration, cameras=placed)
    judged = {name: _judged(camera, residuals.get(name)) for name, camera in calibration.cameras.items()}
    return replace(calibration, cameras=judged)


def _level(calibration: Calibration, floors: dict[str, Array | None]) -> Calibration:
    """Return the whole calibration rotated and lifted so that the reference camera's floor is the stage's."""
    plane = floors.get(calibration.reference)
    if plane is None:
        return calibration
    T = calibration.cameras[calibration.reference].T_stage_camera
    up = T[:3, :3] @ plane[:3]
    turn = make_transform(rotation_between(up, np.array([0.0, 0.0, 1.0])), np.zeros(3))
    on_floor = transform_points(turn @ T, plane[:3] * plane[3])
    turn[2, 3] -= on_floor[2]
    return replace(
        calibration,
        cameras={
            name: replace(camera, T_stage_camera=turn @ camera.T_stage_camera)
            for name, camera in calibration.cameras.items()
        },
    )


def _pairs(
    frames: Sequence[DepthFrame], cameras: dict[str, DepthCamera], calibration: Calibration
) -> dict[int, tuple[Array, Array, Array]]:
    """Return points, their places on the body and the normals there, by camera index."""
    tracker = Tracker(cameras, {name: calibration.cameras[name].T_stage_camera for name in cameras})
    found: dict[int, list[tuple[Array, Array, Array]]] = {}
    names = list(cameras)
    for number, (images, following) in enumerate(with_next(frame_sets(frames, calibration, len(cameras)))):
        if number >= MOST_SETS:
            break
        tracker.track(images, following)
        body = tracker.on_body() if number % _EVERY == 0 else None
        if body is None:
            continue
        for position, name in enumerate(images):
            own = (body.camera == position) & (body.distance < 3 * _REACH_M)
            found.setdefault(names.index(name), []).append(
                (body.points[own], body.places[own], body.normals[own])
            )
    return {index: _joined(some) for index, some in found.items()}


def _joined(some: list[tuple[Array, Array, Array]]) -> tuple[Array, Array, Array]:
    seen, places, normals = (np.concatenate(arrays) for arrays in zip(*some, strict=True))
    return seen, places, normals


def _move(seen: Array, places: Array, normals: Array, T: Array, floor: Array | None) -> Array:
    """Return the rigid transform, 4x4 in the stage, that brings a camera's points onto the body and its floor onto
    the stage's; two Gauss-Newton steps with weights by Geman & McClure.
    """
    move = np.eye(4)
    corners = np.zeros((0, 3))
    if floor is not None:
        corners = floor_corners(T, floor)
    for _ in range(2):
        moved = transform_points(move, seen)
        offset = ((places - moved) * normals).sum(axis=1)
        weight = 1.0 / (1.0 + (np.linalg.norm(places - moved, axis=1) / _REACH_M) ** 2) ** 2
        rows = np.concatenate([normals, np.cross(moved, normals)], axis=1)
        spots = transform_points(move, corners)
        upward = np.tile([0.0, 0.0, 1.0], (len(spots), 1))
        rows = np.concatenate([rows, np.concatenate([upward, np.cross(spots, upward)], axis=1)])
        offset = np.concatenate([offset, -spots[:, 2]])
        weight = np.concatenate([weight, np.full(len(spots), _FLOOR_WEIGHT * len(seen))])
        step = np.linalg.solve(
            rows.T @ (rows * weight[:, None]) + 1e-6 * np.eye(6), rows.T @ (weight * offset)
        )
        move = make_transform(rotation_of(step[3:]), step[:3]) @ move
    return move


def _judged(camera: CameraCalibration, residual_m: float | None) -> CameraCalibration:
    """Return the camera, judged by its points' distance from the body if all its reasons are `_SPREAD_REASONS`."""
    if residual_m is None:
        return camera
    if not all(isinstance(reason, Said) and reason.code in _SPREAD_REASONS for reason in camera.reasons):
        return camera
    if residual_m > _USABLE_M:
        reason = say(
            "verdict.off_body",
            "its points are {mm} mm off the body (median): calibrate again, and do not move the camera meanwhile",
            mm=f"{residual_m * 1e3:.0f}",
        )
        return replace(camera, verdict="refused", reasons=(reason,))
    return replace(camera, verdict="good" if residual_m < _GOOD_M else "usable", reasons=())
