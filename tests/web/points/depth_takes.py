"""Takes with depth for tests of points: a still performer before two exact cameras, with the cameras' true places."""

from functools import cache
from pathlib import Path

import numpy as np

from studio.engine.animation.motion.authored import stage_motion
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.joints import INDEX, OUTPUT_JOINTS, OUTPUT_OF_CANONICAL_INDEX
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.simulator.body.performers import DEFAULT
from studio.simulator.performer.figure import Figure
from studio.simulator.performer.motion import perform
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage
from studio.take.folder.solves import write_solve
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter
from studio.take.raw.records import intrinsics_of
from studio.wire import PROTOCOL_VERSION, Hello, depth_image, encode
from tests.poses_factory import make_poses
from tests.simulator.crowd_people import beginning
from tests.web.playback.takes import add_picture

CAMERAS = ("camera_0", "camera_1")
COUNT = 24
RATE_HZ = 30.0
BEGIN_S = 1.0
GAP = range(8, 14)
"""Numbers of images that the second camera has lost."""

UNSURE = ("left_elbow", "left_wrist", "left_hand")
"""Joints that the solve knows nothing of."""

DAMAGED = 18
"""Number of an image of the second camera that is damaged."""


@cache
def stage(sensor: str = "ideal") -> DepthStage:
    """The embedded performer before two cameras, with the beginning of the motion: only the first image is taken."""
    motion = perform(beginning(stage_motion(), BEGIN_S), DEFAULT)
    return DepthStage.of(find_sensor(sensor), standard_rig(2), motion, DEFAULT)


@cache
def images(sensor: str = "ideal") -> tuple[np.ndarray, ...]:
    """The first image of each camera [mm]."""
    return tuple(stage(sensor).camera(k).image(0.0) for k in range(len(CAMERAS)))


def skin() -> tuple[np.ndarray, np.ndarray]:
    """The performer's vertices at the first image [m], shape (V, 3), and triangles, shape (F, 3)."""
    figure = Figure(stage().mesh, stage().performance)
    return figure.at(0.0), stage().mesh.triangles


def calibration() -> Calibration:
    """The cameras' true places."""
    rig = standard_rig(2)
    placed = {one.name: CameraCalibration(one.T_stage_camera) for one in rig}
    return Calibration(rig[0].name, placed, Performer(1.75, stage().performance.motion.offsets_m))


def joints() -> np.ndarray:
    """The performer's canonical joints at the first image [m], shape (21, 3)."""
    return stage().performance.motion.positions_m[0]


def poses() -> Poses:
    """A solve with the performer's true joints, sure of all but the left arm's."""
    still = np.tile([1.0, 0.0, 0.0, 0.0], (COUNT, len(OUTPUT_JOINTS), 1))
    made = make_poses(still, root_m=np.tile(joints()[0], (COUNT, 1)), hz=RATE_HZ)
    made.positions_m[:, OUTPUT_OF_CANONICAL_INDEX] = joints()
    made.confidence[:] = 1.0
    made.confidence[:, OUTPUT_OF_CANONICAL_INDEX[[INDEX[name] for name in UNSURE]]] = 0.0
    return made


def take_with_depth(path: Path, *, calibrated: bool = True, solved: bool = True) -> Take:
    """Make a take of 0.8 s in which nobody moves; of the second camera `GAP` is lost and `DAMAGED` is damaged."""
    take = Take.create(path, session=path.parent.name, name=path.name, source="import")
    take.meta["recording"] = "done"
    camera = find_sensor("ideal").camera
    with RawWriter(take.raw_path) as raw:
        for name in CAMERAS:
            hello = Hello(
                protocol_version=PROTOCOL_VERSION, name=name, device="exact", joint_set="canonical",
                boot_id=name, intrinsics=intrinsics_of(camera),
            )  # fmt: skip
            raw.add_camera(hello)
            take.add_camera(hello)
        for number in range(COUNT):
            time_ns = round(number * 1e9 / RATE_HZ)
            for name, depth_mm in zip(CAMERAS, images(), strict=True):
                if name == CAMERAS[1] and number in GAP:
                    continue
                image = depth_image(number, time_ns, depth_mm)
                if name == CAMERAS[1] and number == DAMAGED:
                    image.data = image.data[:40]
                raw.depth(name, encode(image), arrival_ns=time_ns, device_time_ns=time_ns, sequence=number)
    take.save_meta()
    if calibrated:
        take.add_calibration(calibration(), use=True)
    if solved:
        write_solve(take, "studio", settings=preset("studio"), poses=poses(), metrics={})
    add_picture(take)
    return take
