"""Measuring how long one frame of a stage takes."""

import time
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

import numpy as np

Item = TypeVar("Item")

WARM_UP = 10
"""Frames at the beginning that are computed but not counted."""


def per_frame(work: Callable[[Item], Any], items: Iterable[Item]) -> dict[str, float | None]:
    """Return what `bench --json` says of a stage: median and 99th percentile of a frame's time, and the rate.

    The rate is that of the whole run (frames over the time they took together), not of the median frame.
    """
    times_ns = []
    for item in items:
        start = time.perf_counter_ns()
        work(item)
        times_ns.append(time.perf_counter_ns() - start)
    counted_ms = np.array(times_ns[WARM_UP:]) * 1e-6
    return {
        "median_ms": float(np.median(counted_ms)),
        "p99_ms": float(np.percentile(counted_ms, 99)),
        "frames_per_second": float(1e3 / counted_ms.mean()),
        "ratio_to_mink_frame_tasks": None,
    }
