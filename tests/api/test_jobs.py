"""The list of work: lanes, time left, cancelling, what is kept."""

import re
import threading
import time
from pathlib import Path

import pytest

from studio import worker
from studio.api import jobs as module
from studio.api.errors import NotFoundError
from studio.api.jobs import FILES, Job, Jobs
from studio.engine.base.errors import TakeError
from tests.api.camera import wait_until
from tests.api.test_routes import assert_error
from tests.refused import refused


def half_write(file: Path, *, progress) -> None:
    try:
        file.touch()
        progress(0.5)
        while True:
            time.sleep(0.01)
    finally:
        file.unlink()


@pytest.fixture
def jobs(monkeypatch) -> Jobs:
    """A list of work that may run what this file holds."""
    monkeypatch.setattr(worker, "_TEXT", re.compile(r"tests\.api\.test_jobs:\w+"))
    return Jobs()


def state(jobs: Jobs, job: Job) -> str:
    return jobs.get(job.id).state


def test_a_running_job_is_cancelled_and_nothing_half_written_stays(jobs, tmp_path):
    file, told = tmp_path / "half", []
    jobs.listen(lambda: told.append(True))
    job = jobs.submit("export", "monday/one", "one.fbx", f"{__name__}:half_write", file)
    waits = jobs.submit("solve", "monday/one", "raw", f"{__name__}:half_write", file)
    wait_until(file.exists, "it writes")
    assert jobs.cancel(waits.id).state == "cancelled"
    assert jobs.cancel(job.id).state == "cancelling"
    wait_until(lambda: state(jobs, job) == "cancelled", "it ends")
    assert not file.exists() and told
    assert jobs.cancel(job.id).state == "cancelled"
    assert [one.ended != "" for one in jobs.list()] == [True, True]
    assert jobs.clear() == 2 and jobs.list() == []
    with pytest.raises(NotFoundError):
        jobs.cancel(job.id)


def test_files_do_not_wait_for_solves_and_work_at_its_last_step_is_not_cancelled(jobs):
    go = threading.Event()
    held = jobs.call("blind test", "monday/one", "which", go.wait)
    wait_until(lambda: state(jobs, held) == "running", "it runs")
    files = jobs.run(jobs.list_new("import", "", "b"), lambda progress: progress(1.0), FILES, "read")
    wait_until(lambda: state(jobs, files) == "done", "the other lane goes on")
    assert files.step == "read"
    with refused(TakeError, "job.last_step"):
        jobs.cancel(held.id)
    go.set()
    wait_until(lambda: state(jobs, held) == "done", "it ends")


def test_the_time_left_follows_from_the_share_and_the_time_so_far():
    job = Job("1", "solve", "monday/one", "raw")
    assert (job.status().seconds, job.status().left_s) == (None, None)
    job.begin()
    assert job.status().left_s is None
    job.tell(0.25)
    job.began_s = time.monotonic() - 10.0
    assert job.status().left_s == 30
    job.end("done")
    assert job.status().left_s is None and job.status().seconds == 10


def test_what_waits_is_kept_and_what_ended_long_ago_goes(jobs, monkeypatch):
    monkeypatch.setattr(module, "KEPT", 2)
    waiting = [jobs.list_new("solve", "monday/one", str(n)) for n in range(4)]
    ended = [jobs.list_new("export", "monday/one", str(n)) for n in range(3)]
    for job in ended:
        job.end("done")
    assert {one.id for one in jobs.list()} == {job.id for job in (*waiting, *ended[1:])}
    monkeypatch.setattr(module, "KEPT_S", 0.0)
    wait_until(lambda: len(jobs.list()) == len(waiting), "they go")


def test_the_routes(recorded):
    assert recorded.http.delete("/jobs").json() == {"cleared": 0}
    assert_error(recorded.http.post("/jobs/99/cancel"), 404, "not_found")
