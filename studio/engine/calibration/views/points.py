"""Frames of cameras without depth as points: joints as placed by all calibrated cameras together."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.calibration.views.pictures import sees_no_depth
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import INDEX, JOINT_COUNT
from studio.engine.model.triangulation.rays import guessed, on_rays, placed

_NEAR_NS = 40_000_000
"""Largest time from an instant to another camera's frame that counts for it."""

_TOLD_BY_DEPTH = [INDEX["hips"], INDEX["neck"]]
"""Joints that no picture shows; next to depth cameras, only these give them."""


def with_points(
    calibration: Calibration, frames: Mapping[str, Sequence[CameraFrame]]
) -> dict[str, list[CameraFrame]]:
    """Return the calibrated cameras' frames; frames of cameras without depth get `positions`, in their own frame.

    A joint that the cameras cannot place together is unseen. A single camera gets the guess from its picture.

    Args:
        calibration: places the cameras, their lenses and clocks.
        frames: by camera, in device time order.
    """
    names = [name for name in frames if name in calibration.cameras and frames[name]]
    flat = np.array([sees_no_depth(frames[name]) for name in names], dtype=np.bool_)
    if not flat.any():
        return {name: list(frames[name]) for name in names}
    cameras = [calibration.cameras[name] for name in names]
    times = [
        np.array([camera.clock.stage_ns(frame.device_time_ns) for frame in frames[name]])
        for name, camera in zip(names, cameras, strict=True)
    ]
    centres = np.array([camera.T_stage_camera[:3, 3] for camera in cameras])
    out = {}
    for c, name in enumerate(names):
        if not flat[c]:
            out[name] = list(frames[name])
            continue
        to_camera, mine = invert_transform(cameras[c].T_stage_camera), []
        for frame, time_ns in zip(frames[name], times[c], strict=True):
            if len(names) == 1 and frame.picture is not None:
                joints = guessed(cameras[c], frame.picture, frame.confidence, 1.0)
            else:
                joints = _together(calibration, frames, names, times, int(time_ns), flat, centres)[c]
            seen = ~np.isnan(joints[:, 0])
            mine.append(
                replace(
                    frame,
                    positions=transform_points(to_camera, joints),
                    confidence=np.where(seen, frame.confidence, 0.0),
                    picture=None,
                )
            )
        out[name] = mine
    return out


def _together(
    calibration: Calibration,
    frames: Mapping[str, Sequence[CameraFrame]],
    names: list[str],
    times: list[NDArray[np.int64]],
    time_ns: int,
    flat: NDArray[np.bool_],
    centres: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return all cameras' joints at an instant, on the stage [m], shape (camera_count, 21, 3)."""
    positions, confidence = np.full((len(names), JOINT_COUNT, 3), np.nan), np.zeros((len(names), JOINT_COUNT))
    for c, name in enumerate(names):
        nearest = int(np.abs(times[c] - time_ns).argmin())
        if abs(int(times[c][nearest]) - time_ns) > _NEAR_NS:
            continue
        frame, camera = frames[name][nearest], calibration.cameras[name]
        confidence[c] = frame.confidence
        if frame.picture is not None:
            positions[c] = on_rays(camera, frame.picture)
            if not flat.all():
                positions[c, _TOLD_BY_DEPTH] = np.nan
        else:
            positions[c] = transform_points(camera.T_stage_camera, frame.positions)
    return placed(positions, confidence, centres, flat)[0]
