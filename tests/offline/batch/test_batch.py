"""Batches: on a pool of processes, on a real Dask cluster that loses a worker, again, and with takes that fail."""

import json
import os
import signal
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from studio.__main__ import main
from studio.commands.takes.batch import find_takes
from studio.offline.batch.jobs import BatchJob, do
from studio.offline.batch.run import run_jobs
from tests.acceptance.processes import wait_until
from tests.web.playback.takes import take_with_solves

TAKES = 3


@pytest.fixture
def sessions(tmp_path: Path) -> Path:
    """Takes of one session, with the solves `studio` and `live`."""
    for number in range(TAKES):
        take_with_solves(tmp_path / "sessions" / "monday" / f"take_{number}", seed=number)
    return tmp_path / "sessions"


def export_jobs(sessions: Path, out: Path) -> list[BatchJob]:
    return [
        BatchJob(
            "export",
            str(take),
            {
                "solve": "studio",
                "format": "bvh",
                "out": str(out / f"{take.name}.bvh"),
                "options": {"take_name": take.name},
            },
        )
        for take in find_takes([sessions])
    ]


def test_what_was_done_is_left_alone_until_its_input_changes(sessions: Path, tmp_path: Path) -> None:
    jobs = export_jobs(sessions, tmp_path / "out")
    assert [do(job).state for job in jobs] == ["done"] * TAKES
    assert [do(job).state for job in jobs] == ["skipped"] * TAKES
    os.utime(Path(jobs[0].take) / "solves" / "studio" / "poses.npz")
    (tmp_path / "out" / "take_1.bvh").unlink()
    assert [do(job).state for job in jobs] == ["done", "done", "skipped"]
    (tmp_path / "out" / "take_2.bvh").write_bytes(b"")  # as after a failure of the machine
    assert [do(job).state for job in jobs] == ["skipped", "skipped", "done"]


def test_the_command_exports_all_and_tells_what_failed(sessions: Path, tmp_path: Path, capsys) -> None:
    (sessions / "monday" / "take_1" / "solves" / "studio" / "poses.npz").write_bytes(b"broken")
    arguments = [
        "batch",
        "export",
        str(sessions),
        "--solve",
        "studio",
        "--format",
        "csv",
        "--out",
        str(tmp_path / "out"),
    ]
    assert main([*arguments, "--processes", "2", "--json", str(tmp_path / "r.json")]) == 1
    result = json.loads((tmp_path / "r.json").read_text())
    assert (result["done"], result["failed"]) == (TAKES - 1, 1)
    told = capsys.readouterr()
    assert "take_1" in told.err and "solve the take again" in told.err
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "monday_take_0_studio.csv", "monday_take_2_studio.csv",
    ]  # fmt: skip


def test_no_take_is_an_error(tmp_path: Path, capsys) -> None:
    assert main(["batch", "solve", str(tmp_path)]) == 1
    assert "no take" in capsys.readouterr().err
    assert main(["batch", "export", str(tmp_path), "--processes", "0"]) == 2


@pytest.fixture
def cluster(tmp_path: Path):
    """A scheduler and two workers, processes of their own; yields the address and the workers."""
    file = tmp_path / "scheduler.json"
    with ExitStack() as stack:

        def start(name: str, *arguments: str) -> subprocess.Popen[bytes]:
            process = subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.{name}", *arguments, "--no-dashboard"],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                cwd=tmp_path,
            )
            stack.callback(process.wait, 30)
            stack.callback(process.terminate)
            return process

        start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
        wait_until(lambda: file.exists() and file.read_text().endswith("}"), "the scheduler is there")
        address = json.loads(file.read_text())["address"]
        own = ["--nthreads", "1", "--no-nanny", "--local-directory"]
        yield address, [start("dask_worker", address, *own, str(tmp_path / f"worker_{i}")) for i in range(2)]


def test_a_dask_cluster_that_loses_a_worker_finishes(sessions: Path, tmp_path: Path, cluster) -> None:
    address, workers = cluster
    jobs = export_jobs(sessions, tmp_path / "out")
    ended = []

    def told(done, count: int, total: int) -> None:
        ended.append(done)
        if count == 1:
            workers[0].send_signal(signal.SIGKILL)

    done = run_jobs(jobs, processes=1, scheduler=address, told=told)
    assert {one.state for one in done} <= {"done", "skipped"} and len(ended) == TAKES
    files = sorted(
        path.name for path in (tmp_path / "out").glob("take*")
    )  # what was cut off has another name
    assert files == [f"take_{i}.bvh" for i in range(TAKES)]


def test_a_scheduler_that_does_not_answer(sessions: Path, tmp_path: Path, capsys) -> None:
    arguments = ["batch", "export", str(sessions), "--solve", "studio", "--out", str(tmp_path / "out")]
    assert main([*arguments, "--scheduler", "nonsense://127.0.0.1:1"]) == 1
    assert "scheduler" in capsys.readouterr().err
