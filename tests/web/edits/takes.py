"""A small take that can be solved: two calibrated cameras, three seconds."""

from pathlib import Path

from studio.engine.model.settings.settings import preset
from studio.offline.replay import solve_take
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter
from studio.wire import encode
from tests.live.performer import calibration, frame, hello
from tests.web.playback.takes import add_picture

CAMERAS = ["camera_0", "camera_1"]


def solved_take(path: Path) -> Take:
    """Make the take at a path, with the solve `studio`."""
    take = Take.create(path, session=path.parent.name, name=path.name, source="import", calibration_s=0.5)
    with RawWriter(take.raw_path) as writer:
        for name in CAMERAS:
            writer.add_camera(hello(name))
            take.add_camera(hello(name))
        for k in range(90):
            for index, name in enumerate(CAMERAS):
                message = frame(index, k, k * 33_333_333, k / 30)
                time_ns = message.device_time_ns
                writer.frame(
                    name, encode(message), arrival_ns=time_ns, device_time_ns=time_ns, sequence=k
                )  # fmt: skip
    take.meta["recording"] = "done"
    take.add_calibration(calibration(CAMERAS), use=True)
    solve_take(take, preset("studio"), name="studio")
    add_picture(take)
    return take
