"""Simulated and recorded depth for the tracker's tests."""

import json
from pathlib import Path

import numpy as np
from PIL import Image

from studio.engine.model.cameras.depth import DepthCamera, DepthFrame
from studio.engine.model.joints import INDEX
from studio.simulator.body.performers import TUNING
from studio.simulator.performer.motion import perform
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage

LIMBS = [
    INDEX[f"{side}_{name}"]
    for side in ("left", "right")
    for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
]
PUNCHES = "depth/punch_3_azure_kinect"


def simulated(motion, *, cameras=1, performer=TUNING[0], begin_s=0.0, end_s=1.0, seed=0):
    """Intrinsics, transforms, image sets and true joints of a simulated stage at 30 Hz."""
    rig, sensor = standard_rig(cameras), find_sensor("azure-kinect")
    performance = perform(motion, performer)
    stage = DepthStage.of(sensor, rig, performance, performer, seed=seed)
    images = [stage.camera(index) for index in range(cameras)]
    times = np.arange(begin_s, end_s, 1 / 30)
    sets = [
        {
            camera.name: DepthFrame(camera.name, k, round(t * 1e9) + 1, image.image(float(t)))
            for camera, image in zip(rig, images, strict=True)
        }
        for k, t in enumerate(times)
    ]
    truth = np.stack([performance.at(float(t))[0] for t in times])
    return (
        {camera.name: sensor.camera for camera in rig},
        {camera.name: camera.T_stage_camera for camera in rig},
        sets,
        truth,
    )


def recorded(folder: Path, names, count):
    """Intrinsics, transforms and image sets of a recording's first images."""
    cameras, sets = {}, [{} for _ in range(count)]
    for name in names:
        about = json.loads((folder / name / "camera.json").read_text())
        cameras[name] = DepthCamera(
            about["fx"], about["fy"], about["cx"], about["cy"], about["width"], about["height"]
        )
        lines = (folder / name / "depth.txt").read_text().splitlines()
        for k, line in enumerate(lines[:count]):
            time_s, file = line.split()
            with Image.open(folder / name / file) as image:
                depth_mm = np.array(image).astype(np.uint16)
            sets[k][name] = DepthFrame(name, k, round(float(time_s) * 1e9) + 10**9, depth_mm)
    placed = json.loads((folder / "calibration.json").read_text())["cameras"]
    return cameras, {name: np.array(placed[name]["T_stage_camera"]) for name in names}, sets


def truth_at(folder: Path, times_ns):
    """True limb joints at times [ns], shape (time_count, 12, 3), in the order of `LIMBS`."""
    rows = np.genfromtxt(folder / "truth" / "joints.csv", delimiter=",", names=True)
    seconds = np.array(times_ns) * 1e-9 - 1.0
    out = np.empty((len(seconds), len(LIMBS), 3))
    names = list(INDEX)
    for k, joint in enumerate(LIMBS):
        for a, axis in enumerate("xyz"):
            out[:, k, a] = np.interp(seconds, rows["time_s"], rows[f"{names[joint]}_{axis}"])
    return out
