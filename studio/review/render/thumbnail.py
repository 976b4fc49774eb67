"""A small square picture of a take for lists: the mannequin in its widest pose."""

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from studio.engine.base.errors import FormatError, StudioError
from studio.engine.base.files import write_atomically
from studio.engine.model.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.model.poses import Poses
from studio.review.render.figure import Projection, draw_figures
from studio.review.render.performers import DrawnPerformers, looking_at
from studio.take.folder.solved import solved_performers
from studio.take.folder.take import Take

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


def render_thumbnail(poses: Poses | Sequence[Poses], path: str | os.PathLike[str]) -> None:
    """Write a PNG of 128 x 128 pixels, atomically, of one performer or several.

    Raises:
        FormatError: no frames, another skeleton than the output skeleton, or bones that no body fits.
    """
    performers = [poses] if isinstance(poses, Poses) else list(poses)
    if any(one.joint_names != OUTPUT_JOINTS or one.frame_count == 0 for one in performers):
        raise FormatError(
            "picture.other_skeleton", "a picture needs frames of the output skeleton; solve the take again"
        )
    first = performers[0]
    figures = DrawnPerformers.of("", performers).at(float(first.time_s[telling_frame(first)]))
    view = Projection(width=SIZE_PX, height=SIZE_PX, pixels_per_m=SIZE_PX / _SEEN_M, horizon=0.9)
    picture = Image.fromarray(draw_figures(figures, looking_at(figures, view)))
    with write_atomically(path) as file:
        picture.save(file, format="PNG", optimize=True)


def render_thumbnails(wanted: list[tuple[Path, Path]]) -> list[Path]:
    """Draw thumbnails of takes, given each one's solve folder and picture path; return the pictures made."""
    made = []
    with tempfile.TemporaryDirectory() as folder:
        drawn = Path(folder) / "picture.png"
        for solve, picture in wanted:
            try:
                take = Take.open(solve.parent.parent)
                performers = solved_performers(take, solve.name)
                render_thumbnail([one.poses for one in performers], drawn)
                _put(drawn, picture)
            except (StudioError, OSError):
                continue  # damaged (the list reports it), or the take was removed or renamed meanwhile
            made.append(picture)
    return made


def _put(drawn: Path, picture: Path) -> None:
    """Put a picture into its take, atomically; a missing take folder is not recreated."""
    picture.parent.mkdir(exist_ok=True)
    part = picture.with_suffix(".part")
    part.write_bytes(drawn.read_bytes())
    part.replace(picture)
