"""Metadata of Azure Kinect files: depth modes and the factory calibration, to intrinsics and back.

The calibration's 14 numbers are `cx cy fx fy k1 k2 k3 k4 k5 k6 codx cody p2 p1`, the first four as shares of the
whole sensor with the corner of the first pixel at 0. A depth mode bins and crops the sensor.

Source: Azure Kinect Sensor SDK 1.4, src/calibration and src/transformation (mode-specific intrinsics), MIT.
"""

import json
from typing import Any, NamedTuple

import numpy as np

from studio import wire
from studio.engine.base.errors import FormatError
from studio.engine.model.cameras.depth import DepthCamera


class DepthMode(NamedTuple):
    """A depth mode: side of the binned square sensor, the crop's corner, and the image's size [pixels]."""

    sensor: int
    left: int
    top: int
    width: int
    height: int


MODES: dict[str, DepthMode] = {
    "NFOV_2X2BINNED": DepthMode(512, 96, 90, 320, 288),
    "NFOV_UNBINNED": DepthMode(1024, 192, 180, 640, 576),
    "WFOV_2X2BINNED": DepthMode(512, 0, 0, 512, 512),
    "WFOV_UNBINNED": DepthMode(1024, 0, 0, 1024, 1024),
}


def mode_of(camera: DepthCamera) -> str:
    """Return the depth mode with a camera's image size.

    Raises:
        FormatError: no mode has it.
    """
    for name, mode in MODES.items():
        if (mode.width, mode.height) == (camera.width, camera.height):
            return name
    sizes = ", ".join(f"{mode.width} x {mode.height}" for mode in MODES.values())
    raise FormatError(
        "depth.k4a_size",
        "images of {width} x {height} do not fit an Azure Kinect file; allowed: {sizes}",
        width=camera.width,
        height=camera.height,
        sizes=sizes,
    )


def intrinsics(calibration: str | bytes, mode_name: str) -> wire.Intrinsics:
    """Return the depth camera's intrinsics in a depth mode from `calibration.json`.

    The rational model of early devices has half of the mixed tangential term; the difference is below a
    thousandth of a pixel and is ignored.

    Raises:
        FormatError: an unknown mode, or a calibration that cannot be read.
    """
    mode = MODES.get(mode_name)
    if mode is None:
        raise FormatError(
            "import.k4a_mode",
            "depth mode {mode!r} is not known; allowed: {allowed}",
            mode=mode_name,
            allowed=[*MODES],
        )
    try:
        cameras: list[dict[str, Any]] = json.loads(calibration)["CalibrationInformation"]["Cameras"]
        depth = next(c for c in cameras if c["Purpose"] == "CALIBRATION_CameraPurposeDepth")
        values = np.array(depth["Intrinsics"]["ModelParameters"][:14], dtype=float)
        cx, cy, fx, fy, k1, k2, k3, k4, k5, k6, _, _, p2, p1 = values.tolist()
    except (ValueError, KeyError, TypeError, StopIteration, RecursionError) as error:
        raise FormatError(
            "import.k4a_calibration", "the calibration in the file cannot be read ({error!r})", error=error
        ) from error
    if not np.isfinite(values).all() or min(fx, fy) <= 0:
        raise FormatError(
            "import.k4a_numbers", "the calibration in the file has focal lengths or numbers that cannot be"
        )
    return wire.Intrinsics(
        fx=fx * mode.sensor,
        fy=fy * mode.sensor,
        cx=cx * mode.sensor - mode.left - 0.5,
        cy=cy * mode.sensor - mode.top - 0.5,
        width=mode.width,
        height=mode.height,
        distortion=(k1, k2, p1, p2, k3, k4, k5, k6),
    )


def calibration_json(camera: DepthCamera, serial: str = "") -> str:
    """Return a `calibration.json` from which `intrinsics` reads this camera again.

    Raises:
        FormatError: no depth mode has the camera's image size.
    """
    mode = MODES[mode_of(camera)]
    k1, k2, p1, p2, k3, k4, k5, k6 = (*camera.distortion, *(0.0,) * (8 - len(camera.distortion)))
    parameters = [
        (camera.cx + mode.left + 0.5) / mode.sensor,
        (camera.cy + mode.top + 0.5) / mode.sensor,
        camera.fx / mode.sensor,
        camera.fy / mode.sensor,
        *(k1, k2, k3, k4, k5, k6, 0.0, 0.0, p2, p1),
    ]
    depth = {
        "Intrinsics": {
            "ModelParameterCount": len(parameters),
            "ModelParameters": parameters,
            "ModelType": "CALIBRATION_LensDistortionModelBrownConrady",
        },
        "Location": "CALIBRATION_CameraLocationD0",
        "Purpose": "CALIBRATION_CameraPurposeDepth",
        "MetricRadius": 1.74,
        "Rt": {"Rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "Translation": [0, 0, 0]},
        "SensorHeight": 1024,
        "SensorWidth": 1024,
    }
    return json.dumps(
        {"CalibrationInformation": {"Cameras": [depth], "Metadata": {"SerialId": serial}}}, indent=None
    )
