"""Frames of one or several solves in one PNG: a row per solve, a column per instant."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace

from PIL import Image, ImageDraw, ImageFont

from studio.engine.base.files import write_atomically
from studio.engine.model.performers.bodies import BODIES
from studio.engine.model.poses import Poses
from studio.review.render.figure import Projection, draw_figures
from studio.review.render.performers import DrawnPerformers, looking_at

_MARGIN, _GUTTER, _FOOTER = 14, 6, 44
_DAY_S = 86400.0
_PAPER, _INK, _FAINT = (236, 238, 241), (38, 44, 54), (104, 113, 126)


def stage_times(poses: Poses, times_s: list[float]) -> list[float]:
    """Return the stage times [s] for a user's times; see `stage_time`."""
    return [stage_time(poses.begins_s, one) for one in times_s] if poses.frame_count > 0 else times_s


def stage_time(begins_s: float, time_s: float) -> float:
    """Return the stage time [s] for a user's time, which is a stage time, or counts from the beginning of the take
    if the stage clock is a wall clock (a live take).
    """
    return begins_s + time_s if begins_s > _DAY_S > time_s else time_s


def default_times(poses: Poses, count: int) -> list[float]:
    """Return `count` stage times [s] spread over the poses, away from both ends."""
    start, end = float(poses.time_s[0]), float(poses.time_s[-1])
    return [start + (end - start) * (i + 0.5) / count for i in range(count)]


def render_strip(
    poses: Poses | Mapping[str, Poses | Sequence[Poses]],
    path: str | os.PathLike[str],
    *,
    times_s: list[float] | None = None,
    begins_s: float | None = None,
    clock: str = "time since the performance began [s]",
    count: int = 8,
    cell: tuple[int, int] = (200, 300),
    yaw_deg: float = 25.0,
    body: str = BODIES[0],
) -> None:
    """Write a PNG of the mannequin at some instants.

    Args:
        poses: one solve, or several by name, one row each, in the output skeleton. A solve of several performers is
            the poses of each, in order.
        path: the PNG; written atomically.
        times_s: stage times [s]; the nearest frame is drawn. None = spread over the first solve.
        begins_s: zero of the labels in stage time; None = the first solve's first frame.
        clock: text under the labels that explains their zero.
        count: number of instants if `times_s` is None.
        cell: width and height of one frame [px].
        yaw_deg: direction of the viewer: 0 in front of the T-pose, 90 at the performer's left.
        body: one of the mannequin's `BODIES`.

    Raises:
        FormatError: no frames, another skeleton than the output skeleton, or bones that no body fits.
    """
    given = {"": poses} if isinstance(poses, Poses) else poses
    rows = {
        name: DrawnPerformers.of(name, [row] if isinstance(row, Poses) else row, body)
        for name, row in given.items()
    }
    first = next(iter(rows.values()))
    times = default_times(first.poses[0], count) if times_s is None else times_s
    zero_s = first.begins_s() if begins_s is None else begins_s
    width, height = cell
    view = Projection(width=width, height=height, pixels_per_m=height * 0.45, yaw_deg=yaw_deg)
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
        cells = [row.at(time_s) for time_s in times]
        views = [looking_at(figures, view) for figures in cells]
        scale = min(one.pixels_per_m for one in views)  # the same for the whole row
        for c, (figures, one) in enumerate(zip(cells, views, strict=True)):
            cell_picture = Image.fromarray(draw_figures(figures, replace(one, pixels_per_m=scale)))
            picture.paste(cell_picture, (_MARGIN + c * (width + _GUTTER), top + title))
    for c, time_s in enumerate(times):
        x = _MARGIN + c * (width + _GUTTER) + width / 2
        draw.text(
            (x, picture.height - _FOOTER + 5), f"{time_s - zero_s:.2f}", fill=_FAINT, font=font, anchor="ma"
        )
    draw.text((_MARGIN + 2, picture.height - 20), clock, fill=_FAINT, font=font)
    with write_atomically(path) as file:
        picture.save(file, format="PNG", optimize=True)
