"""The tables of the report of `evaluate`."""

from collections.abc import Mapping
from typing import Any

from studio.report.page import Markup, html_table, paragraph, safe

ROWS: dict[str, tuple[str, int]] = {
    "mpjpe_mm": ("joint error, mm", 1),
    "mpjpe_root_aligned_mm": ("joint error from the hips, mm", 1),
    "pck_50mm": ("joints within 50 mm", 3),
    "joint_angle_error_deg": ("joint angles, degrees", 1),
    "acceleration_error_m_s2": ("acceleration error, m/s2", 1),
    "latency_ms": ("delay, ms", 1),
    "absolute_difference_cm": ("absolute difference, cm", 2),
    "shortest_distance_cm": ("shortest distance, cm", 2),
    "spike_difference": ("spike difference", 2),
    "deviations": ("deviations", 2),
    "jerk_m_s3": ("jerk, m/s3", 0),
    "foot_slide_cm_s": ("foot slide, cm/s", 1),
    "foot_height_error_cm": ("height of standing feet, cm off", 1),
    "bone_length_sd_mm": ("spread of bones, mm", 1),
    "uncertainty_coverage": ("truth within the 90 % ball", 2),
    "cleanup_events_per_min": ("clean-up events a minute", 1),
}
"""Figure -> its words, and decimals."""


def figures_table(figures: Mapping[str, dict[str, Any]], base: str) -> str:
    """Return all figures side by side, with the difference to the first solve."""
    rows = []
    for key, (words, digits) in ROWS.items():
        before = figures[base][key]
        row = [words]
        for name, one in figures.items():
            value = one[key]
            shown = "-" if value is None else f"{value:z.{digits}f}"
            if name != base and value is not None and before is not None:
                shown = Markup(f"{shown}<br><small>{value - before:+.{digits}f}</small>")
            row.append(shown)
        rows.append(row)
    return html_table(["", *figures], rows)


def switches_table(settings: Mapping[str, dict[str, Any]], base: str) -> str:
    """Return which switches each solve has otherwise than the first."""
    if not all(settings.values()):
        return paragraph("Not every solve has settings, so what differs between them is not known.", "faint")
    first = settings[base]
    rows = []
    for name, own in settings.items():
        if name == base:
            continue
        changed = [
            f"{key}: {first.get(key, '-')} to {own.get(key, '-')}"
            for key in sorted(first.keys() | own.keys())
            if key != "effectors" and first.get(key) != own.get(key)
        ]
        if first.get("effectors") != own.get("effectors"):
            changed.append("effectors")
        rows.append([name, Markup("<br>".join(map(safe, changed)) or "the same switches")])
    return html_table(["solve", f"what differs from {base}"], rows)


def aligned_away(figures: dict[str, Any]) -> str:
    """Return what was aligned away before a solve was measured, in words."""
    found = figures["alignment"]
    place = ", ".join(f"{metres:z.3f}" for metres in found["translation_m"])
    parts = [f"turned by {found['rotation_deg']:.2f} deg, moved by ({place}) m"]
    if found["kind"] == "similarity":
        parts.append(f"scaled by {found['scale']:.4f}")
    if found["time_offset_ms"] or found["clock_drift_ppm"]:
        parts.append(f"clock {found['time_offset_ms']:z.1f} ms and {found['clock_drift_ppm']:z.0f} ppm ahead")
    if found["marker_offsets_mm"]:
        parts.append(
            f"offsets of {len(found['marker_offsets_mm'])} markers from the joints fitted on this take"
        )
    return "; ".join(parts)


def edit_list(name: str, figures: dict[str, Any]) -> str:
    """Return a solve's clean-up events, folded away."""
    events = figures["cleanup_events"]
    if not events:
        return paragraph(f"{name}: {'not measured' if events is None else 'nothing'}")
    rows = [
        [
            event["kind"].replace("_", " "),
            event["joint"],
            f"{event['start_s']:.2f}",
            f"{event['end_s']:.2f}",
            f"{event['size']:.1f} {event['unit']}",
            event["detail"],
        ]
        for event in events
    ]
    header = ["what", "joint", "from, s", "to, s", "size", "detail"]
    words = f"{name}: {len(events)} event{'s'[: len(events) > 1]}"
    return f"<details><summary>{safe(words)}</summary>{html_table(header, rows)}</details>"
