"""Frames of one or several solves side by side as one PNG: a row per solve, a column per instant."""

import os
from dataclasses import replace

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from studio.engine.errors import FormatError
from studio.engine.files import write_atomically
from studio.engine.joints import OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.poses import Poses
from studio.render.body import body_scale, place
from studio.render.figure import View, draw_figure

_MARGIN, _GUTTER, _FOOTER = 14, 6, 26
_DAY_S = 86400.0
_PAPER, _INK, _FAINT = (236, 238, 241), (38, 44, 54), (104, 113, 126)


def _cell(poses: Poses, frame: int, view: View, scale: float) -> Image.Image:
    hips = poses.positions_m[frame, OUTPUT_INDEX["Hips"]]
    placement = place(poses.positions_m[frame], poses.rotations_wxyz[frame], scale)
    target = (float(hips[0]), float(hips[1]), 0.0)
    return Image.fromarray(draw_figure(placement, replace(view, target_m=target)))


def _clock_zero_s(poses: Poses) -> float:
    """The stage time that labels count from: 0, or the first frame where the stage clock is a wall clock."""
    start = float(poses.time_s[0])
    return start if start > _DAY_S else 0.0


def default_times(poses: Poses, count: int) -> list[float]:
    """Return `count` instants [s] spread over the poses, away from both ends."""
    start, end = (float(time_s) - _clock_zero_s(poses) for time_s in (poses.time_s[0], poses.time_s[-1]))
    return [start + (end - start) * (i + 0.5) / count for i in range(count)]


def render_strip(
    poses: Poses | dict[str, Poses],
    path: str | os.PathLike[str],
    *,
    times_s: list[float] | None = None,
    count: int = 8,
    cell: tuple[int, int] = (200, 300),
    yaw_deg: float = 25.0,
) -> None:
    """Write a PNG of the mannequin at some instants.

    Args:
        poses: one solve, or several by name: one row each. All in the output skeleton.
        path: of the PNG; written atomically.
        times_s: stage times [s], counted from the first solve's first frame where the stage clock is a wall
            clock (a live take); the nearest frame is drawn. Spread over the first solve where None.
        count: how many instants where `times_s` is None.
        cell: width and height of one frame [px].
        yaw_deg: where the viewer stands: 0 in front of the T-pose, 90 at the performer's left.

    Raises:
        FormatError: no frames, or another skeleton than the output skeleton.
    """
    rows = poses if isinstance(poses, dict) else {"": poses}
    for name, row in rows.items():
        if row.joint_names != OUTPUT_JOINTS:
            raise FormatError(
                f"solve {name!r} has other joints than the output skeleton; solve the take again"
            )
        if row.frame_count == 0:
            raise FormatError(f"solve {name!r} has no frames; nothing to draw")
    first = next(iter(rows.values()))
    times, zero_s = default_times(first, count) if times_s is None else times_s, _clock_zero_s(first)
    width, height = cell
    view = View(width=width, height=height, pixels_per_m=height * 0.45, yaw_deg=yaw_deg)
    title = 22 if any(rows) else 0
    picture = Image.new(
        "RGB",
        (
            2 * _MARGIN + len(times) * (width + _GUTTER) - _GUTTER,
            _MARGIN + len(rows) * (height + title) + _FOOTER,
        ),
        _PAPER,
    )
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(13)
    for r, (name, row) in enumerate(rows.items()):
        top = _MARGIN + r * (height + title)
        draw.text((_MARGIN + 2, top), name, fill=_INK, font=font)
        scale = body_scale(row.positions_m[:: max(1, row.frame_count // 200)])
        for c, time_s in enumerate(times):
            frame = int(np.argmin(np.abs(row.time_s - zero_s - time_s)))
            picture.paste(_cell(row, frame, view, scale), (_MARGIN + c * (width + _GUTTER), top + title))
    for c, time_s in enumerate(times):
        x = _MARGIN + c * (width + _GUTTER) + width / 2
        draw.text((x, picture.height - _FOOTER + 5), f"{time_s:.2f} s", fill=_FAINT, font=font, anchor="ma")
    with write_atomically(path) as file:
        picture.save(file, format="PNG", optimize=True)
