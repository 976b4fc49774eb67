"""A simulated stage for tests: a waving performer of rigid bones, cameras that see it, their calibration."""

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio import wire
from studio.engine.base.geometry import invert_transform, make_transform, transform_points
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.joints import CANONICAL, INDEX, JOINT_COUNT, PARENT_OF_CANONICAL

_OFFSETS = {
    "hips": (0, 0, 0.95), "spine": (0, 0, 0.12), "chest": (0, 0, 0.25), "neck": (0, 0, 0.16),
    "head": (0, 0, 0.16), "shoulder": (0.18, 0, 0.08), "elbow": (0.28, 0, 0), "wrist": (0.26, 0, 0),
    "hand": (0.08, 0, 0), "hip": (0.09, 0, -0.05), "knee": (0, 0, -0.42), "ankle": (0, 0, -0.40),
    "toe": (0, -0.14, -0.07),
}  # fmt: skip


def offsets_m() -> NDArray[np.float64]:
    """The performer's T-pose offsets [m], shape (21, 3)."""
    out = np.zeros((JOINT_COUNT, 3))
    for name in CANONICAL:
        side, _, joint = name.rpartition("_")
        out[INDEX[name]] = _OFFSETS[joint] if side else _OFFSETS[name]
        if side == "right":
            out[INDEX[name], 0] *= -1
    return out


def joints_m(time_s: float) -> NDArray[np.float64]:
    """Joints on the stage [m], shape (21, 3): both arms swing down and up once in two seconds."""
    offsets = offsets_m()
    out = np.zeros_like(offsets)
    angle = 0.6 + 0.6 * np.sin(np.pi * time_s)
    down = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    for name in CANONICAL:
        i = INDEX[name]
        offset = offsets[i]
        if name.split("_")[-1] in ("elbow", "wrist", "hand"):
            offset = (down if name.startswith("left") else down.T) @ offset
        out[i] = offset if name == "hips" else out[INDEX[PARENT_OF_CANONICAL[name]]] + offset
    return out


def camera_transform(index: int) -> NDArray[np.float64]:
    """`T_stage_camera` of the camera: 3.5 m away, the first in front, the next ones 40 degrees on."""
    turn = np.radians(40.0 * index)
    position = np.array([3.5 * np.sin(turn), -3.5 * np.cos(turn), 1.2])
    forward = np.array([-np.sin(turn), np.cos(turn), 0.0])
    down = np.array([0.0, 0.0, -1.0])
    return make_transform(np.column_stack([np.cross(down, forward), down, forward]), position)


def calibration(cameras: list[str]) -> Calibration:
    """The true calibration of these cameras and the performer."""
    placed = {name: CameraCalibration(camera_transform(i)) for i, name in enumerate(cameras)}
    return Calibration(cameras[0], placed, Performer(height_m=1.75, offsets_m=offsets_m()))


def save_stage_calibration(sessions: Path, cameras: list[str]) -> None:
    """Have a stage that starts in `sessions` begin calibrated."""
    folder = sessions / "calibrations"
    folder.mkdir(parents=True)
    (folder / "1.json").write_text(json.dumps(calibration(cameras).to_json()))


def hello(name: str, **changes: object) -> wire.Hello:
    """A camera's first message."""
    values = {
        "protocol_version": wire.PROTOCOL_VERSION,
        "name": name,
        "device": "test",
        "joint_set": "canonical",
    }
    return wire.Hello(**(values | {"boot_id": "boot-1"} | changes))


def frame(index: int, sequence: int, device_time_ns: int, time_s: float) -> wire.SkeletonFrame:
    """What camera number `index` sees of the performer at `time_s`, with a little noise."""
    rng = np.random.default_rng([index, sequence])
    seen = transform_points(invert_transform(camera_transform(index)), joints_m(time_s))
    seen += rng.normal(0.0, 0.004, seen.shape)
    confidence = np.full(JOINT_COUNT, 0.9)
    return wire.skeleton_frame(sequence, device_time_ns, seen, confidence)
