"""Measurement of a stage's time per frame."""

import time
from collections.abc import Callable, Iterable
from typing import Any, NotRequired, TypedDict, TypeVar

import numpy as np

Item = TypeVar("Item")

WARM_UP = 10
"""Number of initial frames that are not counted."""


class StageTiming(TypedDict):
    """A stage's entry in `bench --json`; optional fields are set where known."""

    median_ms: float
    p99_ms: float
    cpu_p99_ms: float
    frames_per_second: float
    ratio_to_mink_frame_tasks: float | None
    share_of_live_budget: NotRequired[float]
    cpu_mean_ms: NotRequired[float]
    ratio_to_one_performer: NotRequired[float]


def per_frame(work: Callable[[Item], Any], items: Iterable[Item]) -> StageTiming:
    """Return a stage's entry in `bench --json`: median and 99th percentile of the time per frame, and the rate.

    The rate is that of the whole run (frames divided by their total time), not of the median frame.
    `cpu_p99_ms` is that of the processor time: the time of a frame on an otherwise idle core.
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
        "cpu_mean_ms": float(np.mean(cpu_ns[WARM_UP:])) * 1e-6,
    }
