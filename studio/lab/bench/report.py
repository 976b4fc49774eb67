"""The results of `bench` as a page: a table of the stages, and plots."""

from typing import Any

from studio.review.report.charts import Bar, bar_chart
from studio.review.report.page import charts_row, html_table, page, paragraph

_COMPARED = ("solve", "solve_mink", "mink_frame_tasks", "mink_retargeting")
_LIVE = ("parse", "record", "sync", "fusion", "solve", "completion", "encode", "broadcast", "pipeline")
_WORDS = {
    "pipeline_by_cameras": "Live pipeline by cameras of 25 joints: median of an output frame [us], whisker to p99",
    "pipeline_by_joints": "Live pipeline by joints, two cameras: median of an output frame [us], whisker to p99",
}


def bench_report(result: dict[str, Any]) -> str:
    """Return the results of `bench --json` as HTML."""
    stages = result["stages"]
    rows = [
        [
            name,
            f"{1e3 * one['median_ms']:.1f}",
            f"{1e3 * one['p99_ms']:.1f}",
            f"{1e3 * one['cpu_p99_ms']:.1f}",
            f"{one['frames_per_second']:.0f}",
            "" if one.get("ratio_to_mink_frame_tasks") is None else f"{one['ratio_to_mink_frame_tasks']:.2f}",
        ]
        for name, one in stages.items()
    ]
    parts = [
        paragraph("Each stage on one core, on the embedded simulated stage of two cameras."),
        charts_row(
            [
                bar_chart("Stages: median of a frame [us], whisker to p99", _bars(stages, _LIVE)),
                bar_chart("Solvers, same joints: median [us], whisker to p99", _bars(stages, _COMPARED)),
            ]
        ),
        html_table(
            [
                "stage",
                "median [us]",
                "p99 [us]",
                "p99 of processor time [us]",
                "frames/s",
                "time / plain mink's",
            ],
            rows,
        ),
        paragraph(f"Most memory that the process had: {result['peak_memory_mb']:.0f} MB."),
    ]
    grown = result.get("growth", {})
    parts.append(charts_row([bar_chart(_WORDS[key], _bars(grown[key])) for key in _WORDS if key in grown]))
    takes = grown.get("take_by_seconds", {})
    if takes:
        speed = [Bar(f"{length} s", one["frames_per_second"]) for length, one in takes.items()]
        memory = [
            Bar(f"{length} s", one["peak_memory_mb"], beside=one["peak_memory_before_mb"])
            for length, one in takes.items()
        ]
        parts.append(
            charts_row(
                [
                    bar_chart("Finishing a take by its length [frames/s]", speed),
                    bar_chart("Most memory by a take's length [MB]", memory, words=("in it", "before")),
                ]
            )
        )
    return page("Speed", parts)


def _bars(points: dict[str, Any], names: tuple[str, ...] | None = None) -> list[Bar]:
    return [
        Bar(
            name.replace("_", " "),
            1e3 * points[name]["median_ms"],
            (1e3 * points[name]["median_ms"], 1e3 * points[name]["p99_ms"]),
        )
        for name in names or points
    ]
