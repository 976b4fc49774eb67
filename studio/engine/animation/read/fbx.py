"""Reader of the animation in an FBX file, by ufbx in a separate process (the extra `fbx`)."""

import os
from pathlib import Path

import numpy as np

from studio.engine.animation.motion.motion import Motion
from studio.engine.animation.read.apart import read_apart
from studio.engine.animation.read.nodes import Nodes, motion_of


def read_fbx(path: str | os.PathLike[str]) -> Motion:
    """Return the motion in an FBX file, sampled at the file's frame rate, on the stage.

    The first animation stack is read; axes and unit are those of the file's settings, the rest pose its bind pose.

    Raises:
        NotAvailableError: the package ufbx is not installed.
        FormatError: the file is missing, not an FBX, damaged, without an animation, or without hips.
    """
    path = Path(path)
    data = read_apart("fbx_worker", path)
    nodes = Nodes(
        names=tuple(str(name) for name in data["names"]),
        parents=data["parents"],
        joints=data["joints"],
        translations=data["translations"],
        rotations_wxyz=data["rotations_wxyz"],
        scales=data["scales"],
        rest=data["rest"],
        own=(data["own_translations"], data["own_rotations_wxyz"], data["own_scales"]),
        frame_s=float(data["frame_s"]),
    )
    return motion_of(nodes, np.eye(3), str(path))
