"""Poses of simulated cameras."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError
from studio.engine.base.geometry import is_rigid, make_transform
from studio.engine.base.sentences import system_says
from studio.wire import is_camera_name

_DISTANCE_M = 3.5
_HEIGHTS_M = (1.0, 1.6)
_AIM_M = (0.0, 0.0, 1.0)
# Angles about the stage: 0 = in front of a performer in T-pose, positive towards the performer's left.
_ANGLES_DEG: dict[int, tuple[float, ...]] = {
    1: (0.0,),
    2: (-35.0, 35.0),
    3: (0.0, -60.0, 60.0),
    4: (0.0, 90.0, 180.0, -90.0),
}
MAX_CAMERAS = len(_ANGLES_DEG)


@dataclass(frozen=True)
class RigCamera:
    """A camera's name and pose; `T_stage_camera` takes OpenCV camera points to the stage [m]."""

    name: str
    T_stage_camera: NDArray[np.float64]


def look_at(position_m: NDArray[np.float64], target_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return T_stage_camera of a camera that stands upright and looks at a point.

    Raises:
        FormatError: the point is straight above or below the camera.
    """
    forward = np.asarray(target_m, dtype=np.float64) - position_m
    right = np.cross(forward, [0.0, 0.0, 1.0])
    if np.linalg.norm(right) < 1e-6 * max(float(np.linalg.norm(forward)), 1e-6):
        raise FormatError(
            "simulator.rig_straight_down",
            "a camera at {position} cannot look straight up or down at {target}; move it",
            position=list(position_m),
            target=list(target_m),
        )
    forward = forward / np.linalg.norm(forward)
    right = right / np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward], axis=1)
    return make_transform(rotation, np.asarray(position_m, dtype=np.float64))


def standard_rig(cameras: int) -> tuple[RigCamera, ...]:
    """Return the rig of 1 to 4 cameras at 3.5 m, heights 1.0 and 1.6 m in turn, named `camera_0` and so on.

    Raises:
        FormatError: another number of cameras.
    """
    if cameras not in _ANGLES_DEG:
        raise FormatError(
            "simulator.rig_standard",
            "{n} cameras: the standard rigs have 1 to {most}; give a rig file for others",
            n=cameras,
            most=MAX_CAMERAS,
        )
    rig = []
    for k, angle in enumerate(np.radians(_ANGLES_DEG[cameras])):
        position = np.array([_DISTANCE_M * np.sin(angle), -_DISTANCE_M * np.cos(angle), _HEIGHTS_M[k % 2]])
        rig.append(RigCamera(f"camera_{k}", look_at(position, np.array(_AIM_M))))
    return tuple(rig)


def read_rig(path: str | Path) -> tuple[RigCamera, ...]:
    """Return the rig in a JSON file: `{"cameras": {"<name>": {...}}}`, reference camera first.

    A camera has either `position_m` and, if not [0, 0, 1], `look_at_m`, or `T_stage_camera` (4x4).

    Raises:
        FormatError: the file cannot be read, or a camera does not have this form.
    """
    try:
        value = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise FormatError(
            "simulator.rig_unreadable",
            "cannot read rig {path}: {error}; give a JSON file",
            path=path,
            error=system_says(error),
        ) from error
    except (ValueError, RecursionError) as error:
        raise FormatError(
            "simulator.rig_not_json",
            "rig {path} is not JSON ({error}); see the documentation of `studio simulate`",
            path=path,
            error=error,
        ) from error
    cameras = value.get("cameras") if isinstance(value, dict) else None
    if not isinstance(cameras, dict) or not cameras:
        raise FormatError(
            "simulator.rig_no_cameras",
            "rig {path} needs `cameras`, an object of cameras by name, with at least one",
            path=path,
        )
    return tuple(_camera(path, name, camera) for name, camera in cameras.items())


def _camera(path: str | Path, name: str, camera: object) -> RigCamera:
    if not is_camera_name(name):
        raise FormatError(
            "simulator.rig_camera_name",
            "rig {path}: camera name {name!r}; allowed: 1 to 63 letters, digits, `_`, `.`, `-`",
            path=path,
            name=name,
        )
    if isinstance(camera, dict) and "T_stage_camera" in camera:
        T = _numbers(path, name, camera["T_stage_camera"], (4, 4))
        if not is_rigid(T):
            raise FormatError(
                "simulator.rig_not_rigid",
                "rig {path}: T_stage_camera of {name} is not a rigid 4x4 transform with det(R) = +1",
                path=path,
                name=name,
            )
        return RigCamera(name, T)
    if isinstance(camera, dict) and "position_m" in camera:
        position = _numbers(path, name, camera["position_m"], (3,))
        return RigCamera(name, look_at(position, _numbers(path, name, camera.get("look_at_m", _AIM_M), (3,))))
    raise FormatError(
        "simulator.rig_no_position",
        "rig {path}: camera {name} needs position_m (and look_at_m), or T_stage_camera",
        path=path,
        name=name,
    )


def _numbers(path: str | Path, name: str, value: object, shape: tuple[int, ...]) -> NDArray[np.float64]:
    try:
        array = np.array(value if isinstance(value, Sequence) else np.nan, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.array(np.nan)
    if array.shape != shape or not np.isfinite(array).all():
        raise FormatError(
            "simulator.rig_numbers",
            "rig {path}: camera {name} needs {shape} finite numbers, got {value!r}",
            path=path,
            name=name,
            shape=" x ".join(map(str, shape)),
            value=value,
        )
    return array
