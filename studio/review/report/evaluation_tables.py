"""The tables of the report of `evaluate`."""

from collections.abc import Mapping

from studio.engine.metrics.results import Evaluation
from studio.engine.model.settings.settings import SettingsJson
from studio.review.report.page import Markup, html_table, paragraph, safe
from studio.review.report.words import ENGLISH, Words

ROWS: dict[str, tuple[str, int]] = {
    "mpjpe_mm": ("joint error, mm", 1),
    "mpjpe_root_aligned_mm": ("joint error from the hips, mm", 1),
    "pck_50mm": ("joints within 50 mm", 3),
    "joint_angle_error_deg": ("joint angles, degrees", 1),
    "acceleration_error_m_s2": ("acceleration error, m/s2", 1),
    "latency_ms": ("delay, ms", 1),
    "absolute_difference_cm": ("absolute difference, cm", 2),
    "shortest_distance_cm": ("shortest distance, cm", 2),
    "spike_difference": ("spike difference, the thesis's", 2),
    "deviations": ("deviations", 2),
    "jerk_m_s3": ("jerk, m/s3", 0),
    "foot_slide_cm_s": ("foot slide in the reference's stance, cm/s", 1),
    "own_stance_foot_slide_cm_s": ("foot slide in its own stance, cm/s", 1),
    "foot_height_error_cm": ("height of standing feet, cm off", 1),
    "bone_length_sd_mm": ("spread of bones, mm", 1),
    "uncertainty_coverage": ("truth within the 90 % ball", 2),
    "cleanup_events_per_min": ("clean-up events a minute, against the reference", 1),
}
"""Figure -> its label and decimals."""


def figures_table(figures: Mapping[str, Evaluation], base: str, say: Words) -> str:
    """Return all figures side by side, with the difference to the first solve."""
    rows = []
    for key, (words, digits) in ROWS.items():
        before = figures[base][key]
        row = [say(words)]
        for name, one in figures.items():
            value = one[key]
            shown = "-" if value is None else f"{value:z.{digits}f}"
            if name != base and value is not None and before is not None:
                shown = Markup(f"{shown}<br><small>{value - before:+.{digits}f}</small>")
            row.append(shown)
        rows.append(row)
    return html_table(["", *figures], rows)


def switches_table(settings: Mapping[str, SettingsJson], base: str, say: Words) -> str:
    """Return the switches in which each solve differs from the first."""
    if not all(settings.values()):
        return paragraph(
            say("Not every solve has settings, so what differs between them is not known."), "faint"
        )
    first = settings[base]
    rows = []
    for name, own in settings.items():
        if name == base:
            continue
        changed = [
            say(
                "{switch}: {before} to {after}",
                switch=key,
                before=first.get(key, "-"),
                after=own.get(key, "-"),
            )
            for key in sorted(first.keys() | own.keys())
            if key != "effectors" and first.get(key) != own.get(key)
        ]
        if first.get("effectors") != own.get("effectors"):
            changed.append(say("effectors"))
        rows.append([name, Markup("<br>".join(map(safe, changed)) or say("the same switches"))])
    return html_table([say("solve"), say("what differs from {base}", base=base)], rows)


def aligned_away(figures: Evaluation, say: Words = ENGLISH) -> str:
    """Return a description of a solve's alignment before its measurement."""
    found = figures["alignment"]
    place = ", ".join(f"{metres:z.3f}" for metres in found["translation_m"])
    angle = f"{found['rotation_deg']:.2f}"
    parts = [say("turned by {angle} deg, moved by ({place}) m", angle=angle, place=place)]
    if found["kind"] == "similarity":
        parts.append(say("scaled by {scale}", scale=f"{found['scale']:.4f}"))
    if found["time_offset_ms"] or found["clock_drift_ppm"]:
        offset, drift = f"{found['time_offset_ms']:z.1f}", f"{found['clock_drift_ppm']:z.0f}"
        parts.append(say("clock {offset} ms and {drift} ppm ahead", offset=offset, drift=drift))
    if found["marker_offsets_mm"]:
        count = len(found["marker_offsets_mm"])
        parts.append(say("offsets of {n} markers from the joints fitted on this take", n=count))
    return "; ".join(parts)


def edit_list(name: str, figures: Evaluation, begins_s: float, say: Words) -> str:
    """Return a solve's clean-up events in a collapsed section; times count from the stage time `begins_s`."""
    events = figures["cleanup_events"]
    if not events:
        return paragraph(say("{name}: not measured" if events is None else "{name}: nothing", name=name))
    rows = [
        [
            say.kind(event["kind"]),
            say.joint(event["joint"]),
            f"{event['start_s'] - begins_s:.2f}",
            f"{event['end_s'] - begins_s:.2f}",
            f"{event['size']:.1f} {event['unit']}",
            say.detail(event["detail"]),
        ]
        for event in events
    ]
    header = [say(words) for words in ("what", "joint", "from, s", "to, s", "size", "detail")]
    words = say("{name}: {n} event" if len(events) == 1 else "{name}: {n} events", name=name, n=len(events))
    return f"<details><summary>{safe(words)}</summary>{html_table(header, rows)}</details>"
