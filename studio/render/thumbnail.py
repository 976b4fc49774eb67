"""A small square picture of a take for lists: the mannequin in the pose that reaches furthest."""

import os

import numpy as np
from PIL import Image

from studio.engine.errors import FormatError
from studio.engine.files import write_atomically
from studio.engine.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.poses import Poses
from studio.render.body import body_scale, place
from studio.render.figure import View, draw_figure

SIZE_PX = 128
_SEEN_M = 2.25  # height of a performer with raised arms, in the picture
_ENDS = [OUTPUT_INDEX[name] for name in ("LeftHand", "RightHand", "LeftFoot", "RightFoot")]
_LOOKED_AT = 300  # frames that are compared


def telling_frame(poses: Poses) -> int:
    """Return the frame in which hands and feet are furthest from the hips, summed up."""
    step = max(1, poses.frame_count // _LOOKED_AT)
    positions = poses.positions_m[::step]
    reach = np.linalg.norm(positions[:, _ENDS] - positions[:, [OUTPUT_INDEX["Hips"]]], axis=-1).sum(axis=1)
    return int(np.argmax(reach)) * step


def render_thumbnail(poses: Poses, path: str | os.PathLike[str]) -> None:
    """Write a PNG of 128 x 128 pixels, atomically.

    Raises:
        FormatError: no frames, or another skeleton than the output skeleton.
    """
    if poses.joint_names != OUTPUT_JOINTS or poses.frame_count == 0:
        raise FormatError("a picture needs frames of the output skeleton; solve the take again")
    frame = telling_frame(poses)
    scale = body_scale(poses.positions_m[:: max(1, poses.frame_count // 200)])
    hips = poses.positions_m[frame, OUTPUT_INDEX["Hips"]]
    view = View(
        width=SIZE_PX,
        height=SIZE_PX,
        pixels_per_m=SIZE_PX / _SEEN_M,
        target_m=(float(hips[0]), float(hips[1]), 0.0),
        horizon=0.9,
    )
    picture = Image.fromarray(
        draw_figure(place(poses.positions_m[frame], poses.rotations_wxyz[frame], scale), view)
    )
    with write_atomically(path) as file:
        picture.save(file, format="PNG", optimize=True)
