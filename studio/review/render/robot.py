"""Pictures, videos and playback of a robot's motion, with MuJoCo."""

import os
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError, NotAvailableError
from studio.engine.base.files import write_atomically
from studio.engine.robots.body.robot import Robot
from studio.engine.robots.body.shapes import BONE_M, bare_bones
from studio.engine.robots.motion import RobotMotion

if TYPE_CHECKING:
    import mujoco

Image = NDArray[np.uint8]
Vector = NDArray[np.float64]

WIDTH, HEIGHT = 480, 480
STRIP = 8
"""Number of pictures in a strip."""

VIDEO_HZ = 30
_VISIBLE = (0, 1, 2, 4)
"""Groups of visible geoms: MuJoCo's default ones, and the floor."""

_GREY = np.array([0.5, 0.5, 0.5, 1.0], dtype=np.float32)

_COLLIDING = 3
"""Group of collision geoms in most models; shown if there is nothing else to show."""


def write_pictures(robot: Robot, motion: RobotMotion, out: Path) -> None:
    """Write a strip of pictures (.png), or a video (.mp4), of a motion.

    Raises:
        FormatError: another file extension.
        NotAvailableError: MuJoCo cannot draw here.
        StudioError: the file cannot be written.
    """
    kind, last = out.suffix.lower(), len(motion.time_s) - 1
    if kind == ".png":
        _write_strip(robot, motion, out, np.linspace(0, last, STRIP).round().astype(int))
    elif kind == ".mp4":
        count = max(1, round((motion.time_s[-1] - motion.time_s[0]) * VIDEO_HZ))
        _write_video(robot, motion, out, np.linspace(0, last, count).round().astype(int))
    else:
        raise FormatError("robot.picture", "{path}: pictures of a robot are .png or .mp4", path=out)


def pictures(robot: Robot, motion: RobotMotion, frames: Sequence[int] | NDArray[np.int64]) -> Iterator[Image]:
    """Yield pictures of some frames, from the front and to the side, shape (HEIGHT, WIDTH, 3).

    Raises:
        NotAvailableError: MuJoCo cannot draw here.
    """
    import mujoco

    robot.model.vis.global_.offwidth, robot.model.vis.global_.offheight = WIDTH, HEIGHT
    try:
        renderer = mujoco.Renderer(robot.model, HEIGHT, WIDTH)
    except Exception as error:  # each drawing library raises its own errors
        raise NotAvailableError(
            "robot.no_drawing",
            "MuJoCo cannot draw here: {error}; set MUJOCO_GL to egl or osmesa",
            error=str(error)[:120],
        ) from error
    with renderer:
        data, option = mujoco.MjData(robot.model), mujoco.MjvOption()
        option.geomgroup[:] = 0
        option.geomgroup[list(_VISIBLE)] = 1
        groups = robot.model.geom_group[robot.model.geom_bodyid > 0]
        option.geomgroup[_COLLIDING] = int(not np.isin(groups, _VISIBLE).any())
        camera, bones = mujoco.MjvCamera(), list(bare_bones(robot.model))
        camera.distance, camera.elevation = 3.6 * robot.leg_m, -10.0
        for frame in frames:
            data.qpos[:] = motion.qpos[frame]
            mujoco.mj_forward(robot.model, data)
            camera.lookat[:] = [*data.qpos[:2], 0.9 * robot.leg_m]
            ahead = data.xmat[1].reshape(3, 3)[:2, 0]
            camera.azimuth = np.degrees(np.arctan2(ahead[1], ahead[0])) + 150.0
            renderer.update_scene(data, camera, option)
            _add_bones(renderer.scene, data, bones)
            yield renderer.render().copy()


def _add_bones(scene: "mujoco.MjvScene", data: "mujoco.MjData", bones: Sequence[tuple[int, Vector]]) -> None:
    """Add a capsule for each bone of bodies without a geom; see `bare_bones`."""
    import mujoco

    capsule = mujoco.mjtGeom.mjGEOM_CAPSULE
    for body, end in bones[: scene.maxgeom - scene.ngeom]:
        geom, begin = scene.geoms[scene.ngeom], data.xpos[body]
        mujoco.mjv_initGeom(geom, capsule, np.zeros(3), np.zeros(3), np.zeros(9), _GREY)
        mujoco.mjv_connector(geom, capsule, BONE_M, begin, begin + data.xmat[body].reshape(3, 3) @ end)
        scene.ngeom += 1


def _write_strip(robot: Robot, motion: RobotMotion, out: Path, frames: NDArray[np.int64]) -> None:
    from PIL import Image as Pillow

    strip = np.concatenate(list(pictures(robot, motion, frames)), axis=1)
    with write_atomically(out) as file:
        Pillow.fromarray(strip).save(file, format="PNG")


def _write_video(robot: Robot, motion: RobotMotion, out: Path, frames: NDArray[np.int64]) -> None:
    import av

    with write_atomically(out) as file, av.open(file, "w", format="mp4") as container:
        stream = container.add_stream("h264", rate=VIDEO_HZ)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for image in pictures(robot, motion, frames):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="rgb24")))
        container.mux(stream.encode())


def play(robot: Robot, motion: RobotMotion) -> None:
    """Play a motion in MuJoCo's viewer, in a loop until its window is closed.

    Raises:
        NotAvailableError: there is no screen.
    """
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise NotAvailableError(
            "robot.no_screen",
            "there is no screen for MuJoCo's viewer; --out FILE.mp4 or FILE.png writes pictures",
        )
    import mujoco
    import mujoco.viewer

    data, bones = mujoco.MjData(robot.model), list(bare_bones(robot.model))
    times = motion.time_s - motion.time_s[0]
    with mujoco.viewer.launch_passive(robot.model, data) as viewer:
        begin_s = time.monotonic()
        while viewer.is_running():
            now_s = (time.monotonic() - begin_s) % max(float(times[-1]), 1e-3)
            data.qpos[:] = motion.qpos[min(int(np.searchsorted(times, now_s)), len(times) - 1)]
            mujoco.mj_forward(robot.model, data)
            scene = viewer.user_scn
            if scene is not None:
                with viewer.lock():
                    scene.ngeom = 0
                    _add_bones(scene, data, bones)
            viewer.sync()
            time.sleep(0.01)
