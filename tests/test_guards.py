"""The tools that guard the code pass, and a canary of each kind shows that they would notice."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROGRAMS = Path(sys.executable).parent


def run(folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    program = PROGRAMS / command[0]
    return subprocess.run(
        [str(program), *command[1:]], cwd=folder, capture_output=True, text=True, check=False
    )


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the program's source and of the contracts."""
    ignored = shutil.ignore_patterns("static", "__pycache__")
    shutil.copytree(ROOT / "studio", tmp_path / "studio", ignore=ignored)
    shutil.copy(ROOT / ".importlinter", tmp_path)
    return tmp_path


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """A file to be written in a folder of the engine, with the tools' configuration above it."""
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    path = tmp_path / "studio" / "engine" / "canary.py"
    path.parent.mkdir(parents=True)
    return path


def test_imports_run_downwards():
    done = run(ROOT, "lint-imports", "--no-cache")
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("file", "line", "contract"),
    [
        ("engine/model/joints.py", "from studio.engine.metrics import evaluate", "each wing imports only"),
        ("engine/solve/pipeline.py", "def f():\n    from studio.engine.whole_take import take", "each wing"),
        ("take/folder/take.py", "import studio.live.engine", "The program"),
        ("engine/base/files.py", "import studio.wire", "The program"),
        ("engine/base/errors.py", "from studio.engine.base import files", "No circle"),
        ("live/cameras/links.py", "from studio.live.calibration import guards", "No circle"),
        ("engine/model/poses.py", "def f():\n    from starlette.responses import Response", "no web"),
        ("simulator/body/mesh.py", "import studio.engine.seeing.fitting.cones", "performer's body"),
        ("engine/animation/mannequin/foot.py", "import studio.engine.model.human.skeleton", "mannequin"),
    ],
)
def test_canary_an_import_that_runs_upwards_is_seen(copy, file, line, contract):
    with (copy / "studio" / file).open("a", encoding="utf-8") as source:
        source.write(f"\n{line}\n")
    done = run(copy, "lint-imports", "--no-cache")
    assert done.returncode != 0
    assert contract in " ".join(done.stdout.partition("Broken contracts")[2].split())


def test_canary_a_new_room_must_be_placed(copy):
    (copy / "studio" / "attic").mkdir()
    (copy / "studio" / "attic" / "__init__.py").touch()
    done = run(copy, "lint-imports", "--no-cache")
    assert done.returncode != 0
    assert "attic" in done.stdout


@pytest.mark.parametrize("command", [("check",), ("format", "--check")])
def test_ruff_has_nothing_to_say(command):
    done = run(ROOT, "ruff", *command, ".")
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("import random\n\nprint(random)\n", "TID251"),
        ("import time\n\n\ndef f() -> float:\n    return time.time()\n", "TID251"),
        ("import time as clock\n\nX = clock.monotonic()\n", "TID251"),
        ("from time import perf_counter\n\nprint(perf_counter)\n", "TID251"),
        ("from datetime import datetime\n\nX = datetime.now()\n", "TID251"),
        ("import numpy as np\n\nnp.random.seed(1)\n", "NPY002"),
        ("from numpy import random\n\nX = random.rand(3)\n", "NPY002"),
        ("import os\n", "F401"),
    ],
)
def test_canary_ruff_sees_clocks_hidden_randomness_and_what_is_unused(source, text, rule):
    source.write_text(text, encoding="utf-8")
    done = run(source.parent, "ruff", "check", "--no-cache", ".")
    assert done.returncode == 1
    assert rule in done.stdout


def test_canary_ruff_sees_bad_form(source):
    source.write_text("x = {  'a':1 }\n", encoding="utf-8")
    assert run(source.parent, "ruff", "format", "--check", "--no-cache", ".").returncode == 1


def test_a_clock_is_allowed_outside_the_engine(source):
    (source.parents[1] / "clock.py").write_text("import time\n\nX = time.time()\n", encoding="utf-8")
    assert run(source.parents[2], "ruff", "check", "--no-cache", ".").returncode == 0


@pytest.mark.timeout(3600)  # pyright takes two minutes of computing, and far longer on a machine that is busy
def test_the_types_fit():
    done = run(ROOT, "pyright")
    assert done.returncode == 0, done.stdout


def test_canary_pyright_sees_a_type_that_does_not_fit(source):
    source.write_text("def f(x: int) -> str:\n    return x\n", encoding="utf-8")
    done = run(source.parents[2], "pyright")
    assert done.returncode == 1
    assert "reportReturnType" in done.stdout


def test_a_class_name_stands_for_one_thing():
    places: dict[str, list[str]] = {}
    for path in (ROOT / "studio").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert {name: where for name, where in places.items() if len(where) > 1} == {}
