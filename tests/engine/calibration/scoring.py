"""How far a calibration is from the truth, and when its cameras disagree."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform, transform_points
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.spans import Span


@dataclass(frozen=True)
class TransformError:
    """RMS displacement over a 3 x 3 x 2 m box on the stage [m], and angle [degrees], relative to the reference."""

    rms_m: float
    angle_deg: float


def transform_error(
    calibration: Calibration, truth: dict[str, NDArray[np.float64]], camera: str
) -> TransformError:
    """Return a camera's error; `truth` is T_stage_camera by camera, on a stage of its own."""
    reference = truth[calibration.reference]
    found = calibration.cameras
    T = invert_transform(found[calibration.reference].T_stage_camera) @ found[camera].T_stage_camera
    true = invert_transform(reference) @ truth[camera]
    axes = np.linspace(-1.5, 1.5, 6), np.linspace(-1.5, 1.5, 6), np.linspace(0, 2, 5)
    box = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    local = transform_points(invert_transform(truth[camera]), box)
    moved = transform_points(reference @ T, local) - box
    cosine = (np.trace(true[:3, :3].T @ T[:3, :3]) - 1) / 2
    return TransformError(
        float(np.sqrt((moved**2).sum(axis=1).mean())), float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    )


def stage_error(
    calibration: Calibration, T_stage_reference: NDArray[np.float64]
) -> tuple[float, float, float]:
    """Return the tilt of the found stage [degrees], the offset of its floor [m] and its turn [degrees]."""
    E = T_stage_reference @ invert_transform(calibration.cameras[calibration.reference].T_stage_camera)
    tilt = float(np.degrees(np.arccos(np.clip(E[2, 2], -1, 1))))
    return tilt, float(E[2, 3]), float(np.degrees(np.arctan2(E[1, 0], E[0, 0])))


def clock_error_ms(
    calibration: Calibration, camera: str, stage_s: float, offset_s: float, drift: float
) -> float:
    """Return a clock's error [ms] at a stage time, given device time = stage time * (1 + drift) + offset."""
    device_ns = round((stage_s * (1 + drift) + offset_s) * 1e9)
    return abs(calibration.cameras[camera].clock.stage_ns(device_ns) * 1e-6 - stage_s * 1e3)


def spans_of(calibration: Calibration, frames: dict[str, list[CameraFrame]], camera: str) -> list[Span]:
    """Return the spans in which a camera disagrees, in seconds since the reference's first frame."""
    since_s = frames[calibration.reference][0].device_time_ns * 1e-9
    return [span.later(-since_s) for span in calibration.cameras[camera].disagrees]
