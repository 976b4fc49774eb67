"""Solves side by side as one animated GIF, from a fixed viewpoint."""

import os
from collections.abc import Mapping, Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from studio.engine.base.errors import SettingsError
from studio.engine.base.files import write_atomically
from studio.engine.model.performers.bodies import BODIES
from studio.engine.model.poses import Poses
from studio.review.render.figure import Projection, draw_figures
from studio.review.render.performers import DrawnPerformers, looking_at

MOST_S = 30.0
"""Maximum length of an animation; each second takes some hundred kilobytes."""

_FRAME_MS = 80
_LOOKS_S = 0.5
_COLOURS = 48
_INK = (104, 113, 126)


def render_moving(
    poses: Mapping[str, Sequence[Poses]],
    path: str | os.PathLike[str],
    *,
    span_s: tuple[float, float] | None = None,
    size: tuple[int, int] = (460, 300),
    yaw_deg: float = 25.0,
    body: str = BODIES[0],
) -> None:
    """Write a GIF of the mannequin at the original speed, 12.5 frames per second.

    Args:
        poses: by solve name, the poses of its performers in order, in the output skeleton; solves are drawn
            side by side.
        path: the GIF; written atomically.
        span_s: start and end in stage time [s]; None = the first solve's.
        size: width and height of one solve [px].
        yaw_deg: direction of the viewer: 0 in front of the T-pose, 90 at the performer's left.
        body: one of the mannequin's `BODIES`.

    Raises:
        SettingsError: it would last longer than `MOST_S`.
        FormatError: as `render_strip`.
    """
    rows = [DrawnPerformers.of(name, row, body) for name, row in poses.items()]
    first = next(iter(poses.values()))
    begin_s, end_s = span_s or (rows[0].begins_s(), max(float(one.time_s[-1]) for one in first))
    if not 0.0 < end_s - begin_s <= MOST_S:
        raise SettingsError(
            "picture.long",
            "a moving picture of {seconds} s: it may last from 0 to {most} s; give its begin and end, --times "
            "FROM,TO",
            seconds=round(end_s - begin_s, 1),
            most=MOST_S,
        )
    width, height = size
    usual = Projection(width=width, height=height, pixels_per_m=height * 0.42, yaw_deg=yaw_deg)
    looks = np.arange(begin_s, end_s, _LOOKS_S)
    views = [looking_at([figure for look in looks for figure in row.at(look)], usual) for row in rows]
    font, frames = ImageFont.load_default(13), list[Image.Image]()
    for time_s in np.arange(begin_s, end_s, _FRAME_MS * 1e-3).tolist():
        picture = Image.new("RGB", (width * len(rows), height))
        for k, (row, view) in enumerate(zip(rows, views, strict=True)):
            picture.paste(Image.fromarray(draw_figures(row.at(time_s), view)), (k * width, 0))
        draw = ImageDraw.Draw(picture)
        for k, name in enumerate(poses):
            draw.text(
                (k * width + 8, 6), f"{name}  {time_s - rows[0].begins_s():.1f} s", fill=_INK, font=font
            )
        frames.append(picture)
    palette = frames[len(frames) // 2].quantize(_COLOURS)  # shared, so that static parts take no space
    still = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    with write_atomically(path) as file:
        still[0].save(
            file,
            format="GIF",
            save_all=True,
            append_images=still[1:],
            duration=_FRAME_MS,
            loop=0,
            optimize=False,
        )
