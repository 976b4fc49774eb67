"""Work in other processes: with a process kept ready and without, and what goes wrong in them."""

import os

import pytest

from studio import worker
from studio.engine.errors import SettingsError, StudioError


def pid_and_square(number: int, *, progress) -> tuple[int, int]:
    progress(0.5)
    return os.getpid(), number**2


def refuse() -> None:
    raise SettingsError("no")


def crash() -> None:
    raise ZeroDivisionError("one over nothing")


def vanish() -> None:
    os._exit(7)


@pytest.fixture(params=[False, True], ids=["cold", "warm"])
def ready(request, monkeypatch):
    """Whether a process is kept ready."""
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
    assert len(pids) == 2 and os.getpid() not in pids


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
