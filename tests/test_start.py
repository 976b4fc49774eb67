"""What a server does not need at its start is not loaded then: its start stays short."""

import json
import os
import shutil
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

NOT_BEFORE_THE_FIRST_ANSWER = (
    "numba",
    "mujoco",
    "mink",
    "scipy.interpolate",
    "scipy.optimize",
    "scipy.signal",
    "scipy.stats",
    "ezc3d",
    "pygltflib",
    "av",
    "rosbags",
    "distributed",
    "ai_edge_litert",
    "ufbx",
    "pxr",
    "cryptography",
)
NOT_FOR_A_WORD = ("numpy", "scipy", "mujoco", "fastapi", "mcap", "tqdm", "studio.engine.model.frames")
READY_S = 3.0

SERVER = f"""
import json, sys, urllib.request
from pathlib import Path
import studio.server.run as server
from studio.server.config import Config
from studio.server.start import serve

def loaded(stage, now):
    print(json.dumps([name for name in {NOT_BEFORE_THE_FIRST_ANSWER!r} if name in sys.modules]), flush=True)
    raise KeyboardInterrupt

server._prepare_for_work = loaded
serve(Config(port=0, sessions=Path(sys.argv[1])))
"""


EARLY = """
import sys
from pathlib import Path
import studio.server.start as start
from studio.server.config import Config

class Client:
    def __init__(self, name, source, **where):
        print(name, source, "fastapi" in sys.modules, flush=True)

    def end(self):
        print("ended", flush=True)

start.ClientProcess = Client
sys.modules["studio.server.run"] = None  # it cannot be loaded
start.serve(Config(port=0, sessions=Path(sys.argv[1])), demo="skeletons")
"""


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, timeout=120)


def test_simulated_cameras_start_before_the_server_s_code_is_loaded_and_end_with_it(tmp_path):
    ended = run("-c", EARLY, str(tmp_path))
    assert ended.stdout.splitlines() == [
        "camera_0 simulated:0/2 False",
        "camera_1 simulated:1/2 False",
        "ended",
        "ended",
    ]
    assert "studio.server.run" in ended.stderr


def test_what_is_loaded_when_the_server_answers(tmp_path):
    printed = run("-c", SERVER, str(tmp_path)).stdout.splitlines()
    assert json.loads(printed[-1]) == []


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["solve", "--help"], ["config"]])
def test_what_light_commands_load(arguments):
    code = (
        "import sys\nfrom studio.__main__ import main\ntry:\n    main(sys.argv[1:])\nexcept SystemExit:\n    pass\n"
        f"print([name for name in {NOT_FOR_A_WORD!r} if name in sys.modules], file=sys.stderr)"
    )
    assert run("-c", code, *arguments).stderr.splitlines()[-1] == "[]"


def test_a_search_for_devices_loads_no_scipy():
    """It is needed for images, not to name what is plugged in; each search is a process."""
    code = (
        "import sys\nfrom studio.camera.finding import child\n"
        "for name, one in child.SOURCES.items():\n    if one.found:\n        child.look(name)\n"
        "print('scipy' in sys.modules)"
    )
    assert run("-c", code).stdout.splitlines()[-1] == "False"


@pytest.mark.long
def test_ready_within_three_seconds(tmp_path):
    """On an idle machine, from the command to the answer of /health, files in the system's memory."""
    command = [sys.executable, "-m", "studio", "serve", "--port", "0", "--sessions", str(tmp_path)]
    times = []
    for _ in range(4):
        start = time.perf_counter()
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
            address = program.stdout.readline().split("is open on ")[1].split()[0]
            urllib.request.urlopen(f"{address}/health", timeout=60).read()
            times.append(time.perf_counter() - start)
            program.terminate()
            program.wait(timeout=60)
    assert min(times) <= READY_S, times


@pytest.fixture
def installed(tmp_path):
    """A folder with `./start`, whose environment is there already; its program notes what it is asked."""
    shutil.copy(ROOT / "start", tmp_path / "start")
    (tmp_path / ".ci").mkdir()
    (tmp_path / ".ci" / "environment.sh").write_text("environment() { :; }\n")
    program = tmp_path / ".venv" / "bin" / "studio"
    program.parent.mkdir(parents=True)
    program.write_text('#!/bin/sh\necho "$@" >> "$(dirname "$0")/../asked"\n')
    program.chmod(0o755)
    (tmp_path / "studio").mkdir()
    for name in ("studio/a.py", "uv.lock"):
        (tmp_path / name).touch()
    return tmp_path


def asked(folder, *arguments):
    """What `./start` asks of its program, in order."""
    log = folder / ".venv" / "asked"
    log.unlink(missing_ok=True)
    subprocess.run([folder / "start", *arguments], check=True, timeout=60)
    return log.read_text().splitlines()


def test_the_solver_is_compiled_once_and_after_each_change(installed):
    assert asked(installed, "--help") == ["--help"]
    assert asked(installed, "camera", "--list") == ["camera --list"]
    assert asked(installed) == ["prepare", ""]
    assert asked(installed, "--port", "9000") == ["--port 9000"]
    prepared = (installed / ".venv" / "prepared").stat().st_mtime
    for changed in ("studio/a.py", "uv.lock"):
        os.utime(installed / changed, (prepared + 5, prepared + 5))
        assert asked(installed, "serve") == ["prepare", "serve"]
        os.utime(installed / changed, (prepared - 5, prepared - 5))
    assert asked(installed) == [""]


def test_a_studio_that_cannot_be_prepared_starts_all_the_same(installed):
    program = installed / ".venv" / "bin" / "studio"
    program.write_text(program.read_text() + '[ "$1" != prepare ]\n')
    assert asked(installed) == ["prepare", ""]
    assert asked(installed) == ["prepare", ""]
