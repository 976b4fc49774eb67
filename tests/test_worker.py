"""Work in other processes: with a process kept ready and without, and what goes wrong in them."""

import os
import time

import pytest

from studio import worker
from studio.engine.errors import SettingsError, StudioError


def pid_and_square(number: int, *, progress) -> tuple[int, int]:
    progress(0.5)
    return os.getpid(), number**2


def refuse() -> None:
    raise SettingsError("no")


def count_for_ever(*, progress) -> None:
    while True:
        progress(0.1)
        time.sleep(0.01)


def crash() -> None:
    raise ZeroDivisionError("one over nothing")


def vanish() -> None:
    os._exit(7)


@pytest.fixture(params=[False, True], ids=["cold", "warm"])
def ready(request, monkeypatch):
    """Whether a process is kept ready."""
    worker.cool_down()
    monkeypatch.setattr(worker, "_PRELOADED", ("json",))
    if request.param:
        worker.warm_up()
    yield request.param
    worker.cool_down()


def test_the_value_and_the_progress_come_back(ready):
    shares: list[float] = []
    pids = set()
    for number in (3, 4):
        pid, square = worker.run_in_process(pid_and_square, number, on_progress=shares.append)
        assert square == number**2
        pids.add(pid)
    assert shares == [0.5, 0.5]
    assert len(pids) == (1 if ready else 2) and os.getpid() not in pids


def test_errors_come_back_and_the_next_work_is_done(ready):
    with pytest.raises(SettingsError, match="no"):
        worker.run_in_process(refuse)
    with pytest.raises(StudioError, match="one over nothing"):
        worker.run_in_process(crash)
    with pytest.raises(StudioError, match="exit code 7"):
        worker.run_in_process(vanish)
    assert worker.run_in_process(abs, -1) == 1


def test_a_ready_process_that_was_killed_is_done_without():
    worker.warm_up()
    try:
        spare = worker._spare
        assert spare is not None
        spare.process.kill()
        spare.process.join()
        assert worker.run_in_process(abs, -2) == 2
    finally:
        worker.cool_down()


def test_work_that_is_stopped_leaves_its_process_fit_for_more(ready):
    shares: list[float] = []
    with pytest.raises(worker.Stopped, match="newer work"):
        worker.run_in_process(count_for_ever, on_progress=shares.append, should_stop=lambda: len(shares) > 3)
    assert worker.run_in_process(abs, -3, should_stop=lambda: False) == 3


def test_a_word_to_stop_that_comes_too_late_stops_nothing_else(ready):
    for number in range(5):
        asked = iter([False, True])
        assert worker.run_in_process(abs, -number, should_stop=lambda a=asked: next(a, True)) == number


def test_what_makes_a_process_ready_runs():
    from studio.warming import prepare

    prepare()
