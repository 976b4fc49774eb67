"""A take of depth alone, of what two simulated cameras see."""

from pathlib import Path

from studio import wire
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.take.folder.new import new_take
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter
from studio.take.raw.records import intrinsics_of
from tests.engine.seeing.cameras.given_cameras import HZ, Watched, a_little_off


def depth_take(path: Path, scene: Watched) -> Take:
    """Make a take of what cameras see, with places as boards give them."""
    with new_take(path, source="import") as made, RawWriter(made.raw_path) as raw:
        for name, camera in scene.cameras.items():
            hello = wire.Hello(
                protocol_version=wire.PROTOCOL_VERSION, name=name, device="simulated", joint_set="canonical",
                boot_id="one", frames_per_second=float(HZ), intrinsics=intrinsics_of(camera),
            )  # fmt: skip
            raw.add_camera(hello)
            made.add_camera(hello)
        for images in scene.sets:
            for name, image in images.items():
                message = wire.depth_image(image.sequence, image.device_time_ns, image.depth_mm)
                raw.depth(
                    name,
                    wire.encode(message),
                    arrival_ns=image.device_time_ns,
                    device_time_ns=image.device_time_ns,
                    sequence=image.sequence,
                )
    take = Take.open(path)
    given = {name: CameraCalibration(T) for name, T in a_little_off(scene.placed, 3).items()}
    take.add_calibration(Calibration("camera_0", given), use=True)
    return take
