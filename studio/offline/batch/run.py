"""Runs jobs on all cores of this machine, or on a Dask cluster."""

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from studio.engine.base.errors import NotAvailableError, StudioError
from studio.offline.batch.jobs import BatchJob, Done, do

ATTEMPTS = 3
"""Attempts at a job whose process was killed."""

Told = Callable[[Done, int, int], None]
"""Receives a job's result, the number of finished jobs, and the number of all."""


def run_jobs(jobs: list[BatchJob], *, processes: int, scheduler: str | None = None, told: Told) -> list[Done]:
    """Do all jobs and return their results, in order.

    Args:
        jobs: each is done once, in any order.
        processes: on this machine; not used with a scheduler.
        scheduler: address of a Dask scheduler, such as tcp://10.0.0.5:8786; its workers see the same folders.
        told: called after each job.

    Raises:
        NotAvailableError: Dask is not installed.
        StudioError: the scheduler does not answer.
    """
    ended: dict[int, Done] = {}
    source = _on_dask(jobs, scheduler) if scheduler else _in_pool(jobs, processes)
    for index, done in source:
        ended[index] = done
        told(done, len(ended), len(jobs))
    return [ended[index] for index in range(len(jobs))]


def _in_pool(jobs: list[BatchJob], processes: int) -> Iterator[tuple[int, Done]]:
    """Yield results by index; a killed process costs its jobs one attempt."""
    left = {index: 0 for index in range(len(jobs))}
    while left:
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(processes, mp_context=context) as pool:
            running: dict[Future[Done], int] = {pool.submit(do, jobs[index]): index for index in left}
            while running:
                finished, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in finished:
                    index = running.pop(future)
                    try:
                        done = future.result()
                    except BrokenProcessPool:
                        left[index] += 1
                        if left[index] < ATTEMPTS:
                            continue
                        done = Done(jobs[index].take, "failed", f"its process was killed {ATTEMPTS} times")
                    del left[index]
                    yield index, done


def _on_dask(jobs: list[BatchJob], scheduler: str) -> Iterator[tuple[int, Done]]:
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise NotAvailableError(
            "batch.no_dask", "--scheduler needs Dask; install it: pip install 'capture-studio[dask]'"
        ) from error
    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise StudioError(
            "batch.scheduler",
            "the scheduler {scheduler} does not answer: {error}; start it, or check the address",
            scheduler=scheduler,
            error=error,
        ) from error
    with client:
        futures: dict[Any, int] = {
            client.submit(do, job, pure=False, retries=ATTEMPTS - 1): index for index, job in enumerate(jobs)
        }
        for future in as_completed(list(futures), loop=client.loop):
            index = futures[future]
            try:
                done = future.result()
            except Exception as error:  # boundary of the cluster: the others continue
                done = Done(jobs[index].take, "failed", f"its worker was lost: {error}")
            yield index, done
