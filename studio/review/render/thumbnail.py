"""A small square picture of a take for lists: the mannequin in its widest pose."""

import os
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from studio.engine.animation.mannequin.performer import Mannequin
from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.files import write_atomically
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.model.poses import Poses
from studio.review.render.figure import Projection, draw_figure

SIZE_PX = 128
_SEEN_M = 2.25  # height of a performer with raised arms, in the picture
_ENDS = [OUTPUT_INDEX[name] for name in ("LeftHand", "RightHand", "LeftFoot", "RightFoot")]
_LOOKED_AT = 300  # number of compared frames


def telling_frame(poses: Poses) -> int:
    """Return the frame with the largest sum of distances of hands and feet from the hips."""
    step = max(1, poses.frame_count // _LOOKED_AT)
    positions = poses.positions_m[::step]
    reach = np.linalg.norm(positions[:, _ENDS] - positions[:, [OUTPUT_INDEX["Hips"]]], axis=-1).sum(axis=1)
    return int(np.argmax(reach)) * step


def render_thumbnail(poses: Poses, path: str | os.PathLike[str]) -> None:
    """Write a PNG of 128 x 128 pixels, atomically.

    Raises:
        FormatError: no frames, another skeleton than the output skeleton, or bones that no body fits.
    """
    if poses.joint_names != OUTPUT_JOINTS or poses.frame_count == 0:
        raise FormatError(
            "picture.other_skeleton", "a picture needs frames of the output skeleton; solve the take again"
        )
    frame = telling_frame(poses)
    hips = poses.positions_m[frame, OUTPUT_INDEX["Hips"]]
    view = Projection(
        width=SIZE_PX,
        height=SIZE_PX,
        pixels_per_m=SIZE_PX / _SEEN_M,
        target_m=(float(hips[0]), float(hips[1]), 0.0),
        horizon=0.9,
    )
    picture = Image.fromarray(
        draw_figure(Mannequin.of(poses), poses.positions_m[frame], poses.rotations_wxyz[frame], view)
    )
    with write_atomically(path) as file:
        picture.save(file, format="PNG", optimize=True)


def render_thumbnails(wanted: list[tuple[Path, Path]]) -> list[Path]:
    """Draw the pictures of takes, given the `poses.npz` and the picture of each; return those that were made."""
    made = []
    with tempfile.TemporaryDirectory() as folder:
        drawn = Path(folder) / "picture.png"
        for poses, picture in wanted:
            try:
                render_thumbnail(Poses.load(poses), drawn)
                _put(drawn, picture)
            except (StudioError, OSError):
                continue  # damaged, as the list says; or the take was removed or renamed meanwhile
            made.append(picture)
    return made


def _put(drawn: Path, picture: Path) -> None:
    """Put a picture into its take, atomically; a missing folder is not made again."""
    picture.parent.mkdir(exist_ok=True)
    part = picture.with_suffix(".part")
    part.write_bytes(drawn.read_bytes())
    part.replace(picture)
