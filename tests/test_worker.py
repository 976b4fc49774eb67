"""Work in other processes: with a process kept ready and without, failures in them, and how work is named."""

import ast
import importlib
import inspect
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from studio import worker
from studio.engine.base.errors import SettingsError, StudioError, TakeError
from studio.take.folder.take import Take
from studio.worker import begin, process
from tests import works
from tests.refused import refused

SOURCE = Path(worker.__file__).parents[1]
PASSED_ON = ("api/jobs.py", "worker/__init__.py", "worker/several.py")
"""Files that hand on a name that they were given."""

BELOW = ("engine", "take", "offline", "review", "library")
"""Rooms whose functions all that start work may name; others name their own."""


@pytest.fixture
def run(monkeypatch):
    """Runs functions of `works`, which are not the studio's. Work that another test left continues."""
    monkeypatch.setattr(worker, "_TEXT", re.compile(rf"tests\.works:\w+|{worker._TEXT.pattern}"))
    return lambda name, *args, **how: worker.run_in_process(f"{works.__name__}:{name}", *args, **how)


@pytest.fixture(params=["cold", "warm", "copied"])
def ready(request, monkeypatch):
    """Whether a process is kept ready, begun anew or as a copy."""
    if request.param == "copied" and not begin.COPIES:
        pytest.skip("this system copies no processes")
    with kept(monkeypatch, copied=request.param == "copied", warm=request.param != "cold"):
        yield request.param != "cold"


@contextmanager
def kept(monkeypatch, copied: bool, warm: bool = True) -> Iterator[None]:
    """A process is kept ready: a copy, or a new one without the code of a solve."""
    worker.cool_down()
    monkeypatch.setattr(begin, "COPIES", copied)
    if not copied:
        real = begin.begin
        monkeypatch.setattr(begin, "begin", lambda **how: real(**how | {"loaded": False}))
    if warm:
        warm_up()
    yield
    worker.cool_down()


def warm_up() -> worker.Worker:
    """Keep a process ready; return it once it is there."""
    worker.warm_up()
    with worker._changed:
        assert worker._changed.wait_for(lambda: worker._spare is not None, 120)
        assert worker._spare is not None
        return worker._spare


def test_the_value_and_the_progress_come_back(ready, run):
    shares: list[float] = []
    pids = set()
    for number in (3, 4):
        pid, square = run("pid_and_square", number, on_progress=shares.append)
        assert square == number**2
        pids.add(pid)
    assert shares == [0.5, 0.5]
    assert len(pids) == (1 if ready else 2) and os.getpid() not in pids


def test_parts_of_the_result_come_back_in_order_before_it(ready, run):
    parts, told = [], []
    value = run(
        "show_thrice", on_part=parts.append, on_progress=lambda share: told.append((len(parts), share))
    )
    assert value == "done" and parts == [[k] * 1000 for k in range(3)]
    assert told == [(k + 1, k / 3) for k in range(3)]


def test_errors_come_back_and_the_next_work_is_done(ready, run):
    with pytest.raises(SettingsError, match="no"):
        run("refuse")
    with refused(StudioError, "work.failed", error="ZeroDivisionError: one over nothing"):
        run("crash")
    with refused(StudioError, "work.broke_off", code=7):
        run("vanish")
    with refused(StudioError, "work.failed", work="refuses"):
        run("refuses")
    with pytest.raises(AttributeError, match="pickle"):
        run("negative", lambda: 1)
    assert run("negative", 1) == -1


def test_a_take_is_opened_in_the_process_as_it_is_by_then(ready, run, tmp_path):
    take = Take.create(tmp_path / "take", session="monday", name="take", source="live")
    changed = Take.open(take.path)
    changed.meta["notes"] = "jump"
    changed.save_meta()
    assert run("notes_of", take) == "jump"
    shutil.rmtree(take.path)
    with refused(TakeError, "take.no_folder"):
        run("notes_of", take)
    assert run("negative", 1) == -1


def test_a_ready_process_that_was_killed_is_done_without(run):
    spare = warm_up()
    try:
        spare.process.kill()
        spare.process.join()
        assert run("negative", 2) == -2
    finally:
        worker.cool_down()


def test_a_server_that_begins_does_not_wait_for_what_is_loaded(monkeypatch):
    worker.cool_down()
    real, loaded = begin.begin, threading.Event()
    monkeypatch.setattr(begin, "begin", lambda **how: loaded.wait(120) and real())
    try:
        worker.warm_up()
        assert worker._spare is None
        loaded.set()
        assert warm_up().process.is_alive()
    finally:
        loaded.set()
        worker.cool_down()


def warming() -> list[threading.Thread]:
    """The threads that begin a process to be kept ready."""
    return [thread for thread in threading.enumerate() if thread.name == "warm up"]


def test_a_process_begins_later_or_with_the_first_work(monkeypatch, run):
    worker.cool_down()
    for thread in warming():  # of an earlier test
        thread.join(120)
    begun: list[dict] = []
    real = begin.begin
    monkeypatch.setattr(begin, "begin", lambda **how: begun.append(how) or real(**how))
    try:
        worker.warm_up(after_s=None)
        assert warming() == []
        worker.warm_up(after_s=600.0)
        (waiting,) = warming()
        assert begun == []
        assert run("negative", 2) == -2
        assert len(begun) == 1 and worker._spare is not None
    finally:
        worker.cool_down()
    waiting.join(60)
    assert not waiting.is_alive()


@pytest.mark.skipif(not begin.COPIES, reason="this system copies no processes")
def test_where_no_copy_can_be_made_processes_begin_anew(tmp_path, monkeypatch):
    """A path of over 107 characters has no room for the socket of the process that is copied."""
    long = tmp_path / ("x" * 100)
    long.mkdir()
    monkeypatch.setenv("TMPDIR", str(long))
    done = subprocess.run([sys.executable, "-c", NO_COPY], capture_output=True, text=True, timeout=600)
    assert done.stdout == "-2\n", done.stderr
    assert "processes are not copied from here on" in done.stderr


NO_COPY = """
import re
from studio import worker
worker._TEXT = re.compile(r"tests\\.works:negative")
if __name__ == "__main__":
    worker.warm_up()
    print(worker.run_in_process("tests.works:negative", 2))
    worker.cool_down()
"""


def test_work_that_is_stopped_leaves_its_process_fit_for_more(ready, run):
    shares: list[float] = []
    with refused(worker.Stopped, "work.stopped"):
        run("count_for_ever", on_progress=shares.append, should_stop=lambda: len(shares) > 3)
    assert run("negative", 3, should_stop=lambda: False) == -3


@pytest.mark.skipif(not hasattr(signal, "SIGUSR1"), reason="this system has no such signal")
def test_work_that_tells_nothing_is_interrupted_and_clears_up(ready, run, tmp_path):
    began = tmp_path / "half_written"
    with pytest.raises(worker.Stopped):
        run("half_write", began, should_stop=began.exists)
    assert not began.exists()
    assert run("negative", 3) == -3


def test_work_that_will_not_leave_is_ended(ready, run, tmp_path, monkeypatch):
    monkeypatch.setattr(worker, "_PATIENCE_S", (0.1, 0.5))
    began = tmp_path / "began"
    with pytest.raises(worker.Stopped):
        run("cling", began, should_stop=began.exists)
    assert run("negative", 3) == -3


def test_work_that_is_done_when_the_word_to_stop_comes_is_done(ready, run, tmp_path, monkeypatch):
    monkeypatch.setattr(worker, "_PATIENCE_S", (60.0, 60.0))
    told = worker._Stopping.tell
    monkeypatch.setattr(worker._Stopping, "tell", lambda self: (told(self), (tmp_path / "stopped").touch()))
    value = run(
        "finish_once_stopped", tmp_path / "began", tmp_path / "stopped",
        on_progress=lambda share: None, should_stop=(tmp_path / "began").exists,
    )  # fmt: skip
    assert value == "done"
    assert run("negative", 3) == -3


def test_a_word_to_stop_that_comes_too_late_stops_nothing_else(ready, run, monkeypatch):
    monkeypatch.setattr(worker, "_PATIENCE_S", (60.0, 60.0))  # a busy machine is no reason to interrupt
    for number in range(5):
        asked = iter([False, True])
        assert run("negative", number, should_stop=lambda a=asked: next(a, True)) == -number


@pytest.fixture
def warm(monkeypatch):
    """A process is kept ready that is no copy."""
    with kept(monkeypatch, copied=False):
        yield


@contextmanager
def one_at_work(run, work: str, file: Path, threads: ThreadPoolExecutor, **options) -> Iterator[Future]:
    """The ready process is at a work that ends with the file, at the end of the block at the latest."""
    spare = worker._spare
    try:
        running = threads.submit(run, work, file, **options)
        while worker._spare is spare:
            time.sleep(0.01)
        yield running
    finally:
        file.touch()
        running.result()


def test_short_works_take_turns_in_one_process(warm, run, monkeypatch, tmp_path):
    """Loading a second process for one would take longer than the work before it."""
    waits = threading.Semaphore(0)

    class Watched(threading.Condition):
        def wait(self, timeout=None):
            waits.release()
            return super().wait(timeout)

    monkeypatch.setattr(worker, "_changed", Watched())
    with ThreadPoolExecutor(4) as threads:
        with one_at_work(run, "pid_once_there", tmp_path / "go", threads) as first:
            others = [threads.submit(run, "pid_once_there", tmp_path) for _ in range(3)]
            for _ in others:
                assert waits.acquire(timeout=60), "it did not wait for the process that is soon back"
        assert {other.result() for other in others} == {first.result()}


@pytest.mark.skipif(not begin.COPIES, reason="this system copies no processes")
def test_short_works_run_beside_each_other_where_processes_are_copied(run, monkeypatch, tmp_path):
    with kept(monkeypatch, copied=True), ThreadPoolExecutor(2) as threads:
        with one_at_work(run, "pid_once_there", tmp_path / "go", threads) as first:
            other = run("pid_once_there", tmp_path)
            assert not first.done()
        assert other != first.result()


@pytest.mark.skipif(not begin.COPIES, reason="this system copies no processes")
def test_a_copy_has_loaded_the_code_and_has_the_environment_of_now(run, monkeypatch):
    with kept(monkeypatch, copied=True):
        monkeypatch.setenv("STUDIO_TOLD_LATER", "yes")
        assert run("loaded", "studio.offline.warming") == (True, "")
        assert run("loaded", "studio.offline.warming", spare=False) == (True, "yes")


def test_what_cannot_be_loaded_in_advance_is_said_and_the_rest_is_loaded():
    done = subprocess.run(
        [sys.executable, "-c", BROKEN], capture_output=True, text=True, check=True, timeout=600
    )
    assert "studio.offline.replay could not be loaded in advance" in done.stderr
    assert done.stdout == "True\n"


BROKEN = """
import sys
sys.modules["studio.offline.replay"] = sys.modules["studio.offline.warming"] = None
import studio.worker.loaded
print("studio.engine.animation.export" in sys.modules)
"""


@pytest.mark.skipif(not begin.COPIES, reason="this system copies no processes")
def test_ctrl_c_does_not_break_what_is_loaded_for_copies():
    """A terminal sends it to all processes of the studio, also while the one that is copied loads its code."""
    with subprocess.Popen(
        [sys.executable, "-c", LOADING],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as studio:
        assert studio.stdout is not None
        assert studio.stdout.readline() == "loading\n"
        os.killpg(studio.pid, signal.SIGINT)
        said = studio.communicate(timeout=600)
    assert said == ("copied\n", "")


LOADING = """
import contextlib, signal, threading, time
import psutil
from studio.worker import begin

def tell():
    while True:
        time.sleep(0.01)
        with contextlib.suppress(psutil.Error):
            for one in psutil.Process().children():
                if "forkserver" in str(one.cmdline()) and one.cpu_times().user > 0.4:
                    print("loading", flush=True)
                    return

signal.signal(signal.SIGINT, lambda *_: None)  # as the server's, which ends in order
threading.Thread(target=tell, daemon=True).start()
one = begin.begin(loaded=True)
print("copied" if begin.COPIES else "begun anew", flush=True)
one.end()
"""


@pytest.mark.parametrize("told", [True, False], ids=["tells progress", "has computed long"])
def test_nobody_waits_for_a_long_work(warm, run, tmp_path, told):
    work, options = "compute_until_there", {}
    if told:
        work, options = "tell_until_there", {"on_progress": lambda share: None}
    else:
        run("call_long_after", 0.3)
    with ThreadPoolExecutor(1) as threads:
        with one_at_work(run, work, tmp_path / "go", threads, **options) as first:
            other = run("pid_once_there", tmp_path)
            assert not first.done()
        assert other != first.result()


@pytest.mark.skipif(not hasattr(os, "getpriority"), reason="this system has no such priorities")
def test_only_work_that_nobody_waits_for_gives_way_from_its_start(ready, run):
    assert run("niceness") == works.niceness()
    assert run("niceness", spare=False) == min(works.niceness() + process.NICENESS, 19)
    assert run("niceness") == works.niceness()


@pytest.mark.parametrize(
    "text", ["os:getpid", "studio:x", "studio.worker:_work", "studio.worker", "xstudio.a:b"]
)
def test_only_public_functions_of_the_studio_are_run(text):
    with pytest.raises(ValueError, match=r"allowed: studio\.package\.module:function"):
        worker.run_in_process(text)


def calls(tree: ast.AST) -> Iterator[tuple[list[ast.expr], dict[str | None, ast.expr]]]:
    """Yield what is given to each start of work: the name of the function with its arguments, and the keywords."""
    for call in ast.walk(tree):
        if not isinstance(call, ast.Call):
            continue
        given, keywords = [call.func, *call.args], {one.arg: one.value for one in call.keywords}
        names = [one.id if isinstance(one, ast.Name) else None for one in given]
        if "run_in_process" in names:  # itself, or where another is to call it
            yield given[names.index("run_in_process") + 1 :], keywords
        elif isinstance(call.func, ast.Attribute) and ast.unparse(call.func) == "jobs.submit":
            yield given[4:], keywords | {"on_progress": call.func}
        elif isinstance(call.func, ast.Attribute) and ast.unparse(call.func) == "jobs.submit_listed":
            yield given[2:], keywords | {"on_progress": call.func}


def problem(room: str, given: list[ast.expr], keywords: dict[str | None, ast.expr]) -> str | None:
    """Say what is wrong with a start of work in a room of the studio."""
    text = given[0].value if given and isinstance(given[0], ast.Constant) else None
    if not isinstance(text, str) or worker._TEXT.fullmatch(text) is None:
        return f"{ast.unparse(given[0]) if given else 'nothing'} names no work"
    module, _, name = text.partition(":")
    if module.split(".")[1] not in (*BELOW, room):
        return f"{text} lies above {room}"
    try:
        signature = inspect.signature(getattr(importlib.import_module(module), name))
        kwargs: dict[str, Any] = {
            one: None
            for one in keywords
            if one not in (None, "spare", "should_stop", "then", "clear", "inherits")
        }
        if kwargs.pop("on_progress", 0) is None:
            kwargs["progress"] = None
        if kwargs.pop("part", 0) is None:
            kwargs["show"] = None
        if any(isinstance(one, ast.Starred) for one in given) or None in keywords:
            signature.bind_partial(*(one for one in given[1:] if not isinstance(one, ast.Starred)), **kwargs)
        else:
            signature.bind(*given[1:], **kwargs)
    except (ImportError, AttributeError, TypeError) as error:
        return f"{text}: {error}"
    return None


STARTS = ("run_in_process", "submit")
"""One of these words is in each file that starts work."""


def problems(room: str, source: str) -> list[str | None]:
    """Say what is wrong with each start of work in a source; None where nothing is."""
    return [problem(room, *call) for call in calls(ast.parse(source))]


def test_all_work_in_the_source_is_there_and_takes_what_it_is_given():
    wrong, count = [], 0
    for path in SOURCE.rglob("*.py"):
        inside, source = path.relative_to(SOURCE), path.read_text(encoding="utf-8")
        if inside.as_posix() not in PASSED_ON and any(word in source for word in STARTS):
            found = problems(inside.parts[0], source)
            count += len(found)
            wrong += [f"{path}: {one}" for one in found if one is not None]
    assert wrong == []
    assert count > 20


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ('run_in_process("studio.offline.replay:solve_takes", take)', "no attribute"),
        ('run_in_threadpool(run_in_process, "studio.offline.replai:solve_take", take)', "No module"),
        ('run_in_process("studio.offline.replay:_plain", take)', "names no work"),
        ('run_in_process("os:getpid")', "names no work"),
        ("run_in_process(solve_take, take)", "names no work"),
        ('run_in_process("studio.server.start:serve", config)', "lies above api"),
        ('run_in_process("studio.live.calibration.tpose:measure_performer", a, b)', "lies above api"),
        ('jobs.submit("solve", "a/b", "x", "studio.offline.replay:solve_take", take)', "missing"),
        ('jobs.submit("x", "a/b", "x", "studio.review.measure:compare_solves", a, b)', "progress"),
        ('run_in_process("studio.library:evaluate", take, path, aligned=how)', "aligned"),
    ],
)
def test_canary_work_that_is_not_there_is_seen(line, why):
    found = problems("api", line)
    assert len(found) == 1 and found[0] is not None and why in found[0]
