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
    `cpu_p99_ms` is that of the processor time: what a frame takes where nobody else wants the core.
    """
    times_ns, cpu_ns = [], []
    for item in items:
        start, cpu_start = time.perf_counter_ns(), time.thread_time_ns()
        work(item)
        cpu_ns.append(time.thread_time_ns() - cpu_start)
        times_ns.append(time.perf_counter_ns() - start)
    counted_ms = np.array(times_ns[WARM_UP:]) * 1e-6
    return {
        "median_ms": float(np.median(counted_ms)),
        "p99_ms": float(np.percentile(counted_ms, 99)),
        "cpu_p99_ms": float(np.percentile(cpu_ns[WARM_UP:], 99)) * 1e-6,
        "frames_per_second": float(1e3 / counted_ms.mean()),
        "ratio_to_mink_frame_tasks": None,
    }
