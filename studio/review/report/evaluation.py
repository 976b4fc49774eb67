"""The report of `evaluate`: solves side by side, the effect of each switch, and the largest errors."""

import base64
import tempfile
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.metrics.figures import thesis
from studio.engine.metrics.reference.alignment import Alignment, align
from studio.engine.metrics.reference.markers import fit_joint_centres
from studio.engine.metrics.reference.matching import Matched, match
from studio.engine.metrics.reference.reference import Markers, Reference
from studio.engine.metrics.results import Evaluation
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SettingsJson
from studio.engine.model.spans import Span
from studio.review.render.strip import render_strip
from studio.review.report.body_diagram import body_diagram, stick_figures
from studio.review.report.bootstrap import blocks, interval
from studio.review.report.charts import curves, range_chart
from studio.review.report.evaluation_tables import aligned_away, edit_list, figures_table, switches_table
from studio.review.report.page import Markup, bullets, charts_row, page, paragraph, safe
from studio.review.report.svg import COLOURS
from studio.review.report.words import ENGLISH, Words

BLOCK_S = 1.0
"""Length of the resampled blocks, within which errors of frames are correlated."""

CLOCK = "time since the performance began"
"""The clock shown to users: `Poses.begins_s` is its zero."""

_TIMES = (
    "Times are since the performance began, as in the replay: 0 is the first frame of {base}, stage time {begins} s. "
    "What is measured against the reference is so over the time and the joints that the reference has."
)
_MOMENTS, _APART_S = 4, 1.0
_CURVES_OF_MOST = 4


@dataclass(frozen=True)
class MeasuredSolve:
    """One solve of a report.

    Attributes:
        poses: the solve.
        figures: from `metrics.evaluate`.
        settings: from its `settings.json`; may be empty.
        disagrees: by camera, the spans of stage time in which it disagreed with the others.
        moved: by camera, its displacement [mm] and turn [degrees] before depth was tracked.
        together: `figures` align several performers in common.
    """

    poses: Poses
    figures: Evaluation
    settings: SettingsJson
    disagrees: Mapping[str, Sequence[Span]] = field(default_factory=dict)
    moved: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    together: bool = False


def evaluation_report(
    title: str,
    solves: Mapping[str, MeasuredSolve],
    reference: Reference | Markers,
    *,
    start_s: float | None = None,
    say: Words = ENGLISH,
) -> str:
    """Return the report as one HTML page; changes are relative to the first solve.

    Args:
        title: of the page, such as the take's name.
        solves: by name, at least one.
        reference: the reference of the figures.
        start_s: stage time before which nothing counts, as for `evaluate`.
        say: the reader's words.
    """
    begins_s = next(iter(solves.values())).poses.begins_s
    parts = [*intro(solves, begins_s, say), *report_parts(solves, reference, start_s=start_s, say=say)]
    return page(title, parts, say.language)


def intro(solves: Collection[str], begins_s: float, say: Words) -> list[str]:
    """Return the introduction of a report: number of compared solves, and zero of the times."""
    base = next(iter(solves))
    count = "{n} solve; what each figure is stands in docs/metrics.md."
    if len(solves) > 1:
        count = "{n} solves; changes are against {base}. What each figure is stands in docs/metrics.md."
    return [
        paragraph(say(count, n=len(solves), base=base), "faint"),
        paragraph(say(_TIMES, base=base, begins=f"{begins_s:.2f}"), "faint"),
    ]


def report_parts(
    solves: Mapping[str, MeasuredSolve],
    reference: Reference | Markers,
    *,
    start_s: float | None = None,
    begins_s: float | None = None,
    level: int = 2,
    say: Words = ENGLISH,
) -> list[str]:
    """Return the sections of a report of one performer.

    Args:
        solves, reference, start_s, say: as in `evaluation_report`.
        begins_s: stage time from which times count [s]; None = the first frame of the first solve.
        level: of the headings.
    """
    matched = {name: _matched(one, reference, start_s) for name, one in solves.items()}
    figures = {name: one.figures for name, one in solves.items()}
    errors = {name: frame_errors_mm(one) for name, one in matched.items()}
    base = next(iter(solves))
    begins_s = solves[base].poses.begins_s if begins_s is None else begins_s
    away = [
        say("Aligned away for {name}: {what}.", name=name, what=aligned_away(one, say))
        for name, one in figures.items()
    ]
    parts = [
        _heading(say("Figures"), level),
        figures_table(figures, base, say),
        bullets(
            away
            + [words for name, one in solves.items() for words in _moves(name, one, say)]
            + [words for name, one in solves.items() for words in _doubts(name, one, say)]
        ),
    ]
    if len(solves) > 1:
        parts += _changes(solves, matched, base, say, level)
    first = matched[base]
    return [
        *parts,
        _heading(say("Error over time"), level),
        curves(
            say("mean over joints"),
            first.time_s - begins_s,
            _on(first, matched, errors),
            unit="mm",
            clock=say(CLOCK),
            height=244,
        ),
        _heading(say("Curves"), level),
        *_axes(matched, base, begins_s, say),
        _heading(say("Worst moments"), level),
        *_moments(solves, matched, errors, base, begins_s, say, level + 1),
        _heading(say("Error of each joint"), level),
        _bodies(figures, say),
        _heading(say("What would have to be cleaned up"), level),
        *(edit_list(name, one, begins_s, say) for name, one in figures.items()),
    ]


def _moves(name: str, one: MeasuredSolve, say: Words) -> list[str]:
    """Return sentences on how cameras were moved before a solve."""
    return [
        say(
            "{name}: {camera} was moved by {mm} mm and turned by {degrees} degrees before its depth was tracked.",
            name=name,
            camera=camera,
            mm=f"{mm:.1f}",
            degrees=f"{degrees:.2f}",
        )
        for camera, (mm, degrees) in one.moved.items()
    ]


def _doubts(name: str, one: MeasuredSolve, say: Words) -> list[str]:
    """Return sentences on the spans in which cameras disagreed in a solve, in seconds since its first frame."""
    begin_s, end_s = float(one.poses.time_s[0]), float(one.poses.time_s[-1])
    return [
        say(
            "{name}: {camera} does not agree with the other cameras from {since} to {until} s of the solve "
            "({mm} mm off): doubt that part.",
            name=name,
            camera=camera,
            since=f"{span.from_s - begin_s:.1f}",
            until=f"{(end_s if span.to_s is None else span.to_s) - begin_s:.1f}",
            mm=f"{span.metres * 1e3:.0f}",
        )
        for camera, spans in one.disagrees.items()
        for span in spans
    ]


def _heading(words: str, level: int) -> str:
    return f"<h{level}>{safe(words)}</h{level}>"


def _matched(one: MeasuredSolve, reference: Reference | Markers, start_s: float | None) -> Matched:
    """Match a solve and its reference as `evaluate` did, with the clock that it found."""
    offset_s, drift_ppm = one.figures["time_offset_ms"] / 1e3, one.figures["clock_drift_ppm"]
    if isinstance(reference, Markers):
        reference, _ = fit_joint_centres(
            one.poses, reference, start_s=start_s, offset_s=offset_s, drift_ppm=drift_ppm
        )
    found = match(one.poses, reference, start_s=start_s, offset_s=offset_s, drift_ppm=drift_ppm)
    if one.together:
        aligned = Alignment.from_json(one.figures["alignment"])
        return replace(found, solve_m=aligned.to_reference(found.solve_m))
    return align(found, similarity=one.figures["alignment"]["kind"] == "similarity")[0]


def frame_errors_mm(matched: Matched) -> NDArray[np.float64]:
    """Return the mean distance over the measured joints in each frame [mm], shape (frame_count,)."""
    solve, reference = matched.pick(matched.joints)
    distance = np.linalg.norm(solve - reference, axis=2)
    counts = np.isfinite(distance).sum(axis=1)
    return np.where(counts > 0, np.nansum(distance, axis=1) / np.maximum(counts, 1), np.nan) * 1e3


def _on(
    first: Matched, matched: Mapping[str, Matched], values: Mapping[str, NDArray[np.float64]]
) -> dict[str, NDArray[np.float64]]:
    """Values of all solves at the first one's instants; NaN outside their time."""
    return {
        name: np.interp(first.time_s, matched[name].time_s, one, left=np.nan, right=np.nan)
        for name, one in values.items()
    }


def _wrist_errors_cm(matched: Matched) -> dict[str, NDArray[np.float64]]:
    """The thesis's two distances in each frame [cm]; empty unless measurable in every frame."""
    found = thesis.curves(matched)
    if found is None or found[0].shape[1] != len(matched.time_s):
        return {}
    solve, reference = found
    paths = [thesis.distance_to_path(a, b) for a, b in zip(solve, reference, strict=True)]
    return {
        "absolute_difference_cm": np.abs(solve - reference).mean(axis=(0, 2)) * 100,
        "shortest_distance_cm": np.mean(paths, axis=0) * 100,
    }


def _changes(
    solves: Mapping[str, MeasuredSolve], matched: Mapping[str, Matched], base: str, say: Words, level: int
) -> list[str]:
    """Effect of each solve's switches relative to the first, with intervals over blocks of a second."""
    each = {
        name: {"mpjpe_mm": frame_errors_mm(one), **_wrist_errors_cm(one)} for name, one in matched.items()
    }
    charts = []
    for key, words in (("mpjpe_mm", "joint error"), ("absolute_difference_cm", "absolute difference"),
                       ("shortest_distance_cm", "shortest distance")):  # fmt: skip
        known = {name: values[key] for name, values in each.items() if key in values}
        if base not in known:
            continue
        beside = _on(matched[base], matched, known)
        rows = [
            (name, *gain(beside[name] - beside[base], matched[base].rate_hz))
            for name in known
            if name != base
        ]
        title = say("Change of {figure} against {base}", figure=say(words), base=base)
        charts.append(range_chart(title, rows, unit=key.rsplit("_", 1)[1]))
    intervals = say(
        "Intervals are 95 %, by bootstrap over blocks of {seconds} s of this take; other takes may differ by more.",
        seconds=f"{BLOCK_S:g}",
    )
    return [
        _heading(say("What each switch gained or cost"), level),
        switches_table({name: one.settings for name, one in solves.items()}, base, say),
        charts_row(charts),
        paragraph(intervals, "faint"),
    ]


def gain(difference: NDArray[np.float64], rate_hz: float) -> tuple[float, float, float]:
    """Return the mean of differences per frame, and its 95 % interval over blocks of `BLOCK_S`."""
    means = blocks(difference, max(1, round(BLOCK_S * rate_hz)))
    low, high = interval(means) if len(means) > 1 else (-np.inf, np.inf)
    return float(np.nanmean(difference)), low, high


def _axes(matched: Mapping[str, Matched], base: str, begins_s: float, say: Words) -> list[str]:
    """Wrists relative to the chest, one chart per axis, as in the thesis's figures."""
    names = list(matched)[:_CURVES_OF_MOST]
    found = {name: thesis.curves(matched[name]) for name in names}
    first = found[base]
    if first is None:
        return [paragraph(say("The reference has no wrists and chest."), "faint")]
    sides = [side for side in ("left", "right") if matched[base].has(f"{side}_wrist")]
    time_s = matched[base].time_s[: first[0].shape[1]]
    charts = []
    for index, side in enumerate(sides):
        for axis, letter in enumerate("xyz"):
            reference = say("reference")
            series = {reference: first[1][index, :, axis] * 100}
            for name, pair in found.items():
                if pair is not None and len(pair[0]) > index:
                    times = matched[name].time_s[: pair[0].shape[1]]
                    series[name] = np.interp(
                        time_s, times, pair[0][index, :, axis] * 100, left=np.nan, right=np.nan
                    )
            title = say("{joint}, {axis}", joint=say.joint(f"{side}_wrist"), axis=letter)
            charts.append(
                curves(title, time_s - begins_s, series, unit="cm", clock=say(CLOCK), reference=reference)
            )
    left_out = ", ".join(list(matched)[_CURVES_OF_MOST:])
    note = [paragraph(say("Left out for clarity: {names}.", names=left_out), "faint")] if left_out else []
    return [paragraph(say("Relative to the chest, after alignment."), "faint"), *charts, *note]


def worst_frames(errors_mm: NDArray[np.float64], time_s: NDArray[np.float64]) -> list[int]:
    """Return the frames with the largest errors, at least a second apart, worst first."""
    found: list[int] = []
    for frame in np.argsort(-np.nan_to_num(errors_mm, nan=-1.0)):
        if all(abs(time_s[frame] - time_s[other]) >= _APART_S for other in found):
            found.append(int(frame))
        if len(found) == _MOMENTS:
            break
    return found


def _moments(
    solves: Mapping[str, MeasuredSolve],
    matched: Mapping[str, Matched],
    errors: Mapping[str, NDArray[np.float64]],
    base: str,
    begins_s: float,
    say: Words,
    level: int,
) -> list[str]:
    parts = []
    for index, (name, one) in enumerate(matched.items()):
        figures = [
            stick_figures(
                f"{one.time_s[frame] - begins_s:.2f} s: {errors[name][frame]:.0f} mm",
                one.solve_m[frame],
                one.reference_m[frame],
                COLOURS[index % len(COLOURS)],
            )
            for frame in worst_frames(errors[name], one.time_s)
        ]
        words = say("{name}, over the reference (without colour), front and side", name=name)
        parts += [_heading(words, level), charts_row(figures)]
    drawn = {name: one.poses for name, one in solves.items() if (one.poses.parents < 0).sum() == 1}
    if drawn:
        times = [
            float(matched[base].time_s[frame])
            for frame in sorted(worst_frames(errors[base], matched[base].time_s))
        ]
        words = say("All solves at the worst moments of {base}", base=base)
        parts += [_heading(words, level), _picture(drawn, times, begins_s, say)]
    return parts


def _picture(poses: dict[str, Poses], times_s: list[float], begins_s: float, say: Words) -> str:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "moments.png"
        render_strip(
            poses, path, times_s=times_s, begins_s=begins_s, clock=f"{say(CLOCK)} [s]", cell=(180, 250)
        )
        data = base64.b64encode(path.read_bytes()).decode()
    alt = safe(say("mannequins of all solves at {n} moments", n=len(times_s)))
    return Markup(f'<img alt="{alt}" src="data:image/png;base64,{data}">')


def _bodies(figures: Mapping[str, Evaluation], say: Words) -> str:
    most = max(max(one["per_joint_mm"].values(), default=1.0) for one in figures.values())
    return charts_row(
        [body_diagram(name, one["per_joint_mm"], most_mm=most, say=say) for name, one in figures.items()]
    )
