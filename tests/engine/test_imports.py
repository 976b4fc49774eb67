"""The engine stays free of the web, the rest of the program, and clocks and random numbers of its own.

Every source file is read as a syntax tree, so that an import inside a function counts too; then all modules are
really imported, so that what they bring along counts. Canaries prove that both would notice.
"""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ENGINE = ROOT / "studio" / "engine"

WEB = ("fastapi", "starlette", "uvicorn", "websockets", "viser", "jinja2", "httpx")
REST = ("studio.api", "studio.web", "studio.camera", "studio.take", "studio.commands", "studio.live",
        "studio.replay", "studio.render", "studio.wire", "studio.bench")  # fmt: skip
CLOCKS = ("time.time", "time.time_ns", "time.monotonic", "time.monotonic_ns", "time.perf_counter",
          "time.perf_counter_ns", "time.process_time", "datetime.datetime.now", "datetime.datetime.utcnow",
          "datetime.datetime.today", "datetime.date.today")  # fmt: skip
RANDOM_ALLOWED = ("default_rng", "Generator", "SeedSequence", "PCG64", "Philox", "BitGenerator")


def forbidden(source: str) -> list[str]:
    """Return what an engine module's source does that it must not, one line each."""
    tree = ast.parse(source)
    names, found = {}, []
    for node in ast.walk(tree):
        for local, bound, target in _imports(node):
            names[local] = bound
            if _within(target, (*WEB, *REST, "random")) or target in CLOCKS or _global_random(target):
                found.append(f"line {node.lineno}: imports {target}")
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            target = _dotted(node, names)
            if target in CLOCKS or _global_random(target):
                found.append(f"line {node.lineno}: uses {target}")
    return found


def _imports(node: ast.AST) -> Iterator[tuple[str, str, str]]:
    """Yield local name, what it is bound to, and what is imported, of an import statement."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            top = alias.name.split(".")[0]
            yield alias.asname or top, alias.name if alias.asname else top, alias.name
    elif isinstance(node, ast.ImportFrom) and node.level == 0:
        for alias in node.names:
            name = f"{node.module}.{alias.name}"
            yield alias.asname or alias.name, name, name


def _dotted(node: ast.Attribute, names: dict[str, str]) -> str:
    """Return the full name of `a.b.c`, with `a` as it was imported; empty where it is no plain name."""
    parts = [node.attr]
    value = node.value
    while isinstance(value, ast.Attribute):
        parts.append(value.attr)
        value = value.value
    if not isinstance(value, ast.Name):
        return ""
    return ".".join([names.get(value.id, value.id), *reversed(parts)])


def _within(name: str, packages: tuple[str, ...]) -> bool:
    return any(name == package or name.startswith(package + ".") for package in packages)


def _global_random(name: str) -> bool:
    """Whether a name is one of numpy's functions that share a hidden generator."""
    return name.startswith("numpy.random.") and name.split(".")[2] not in RANDOM_ALLOWED


def loaded_by(folder: Path, modules: list[str]) -> list[str]:
    """Import modules in a fresh interpreter; return the forbidden ones that are loaded then."""
    code = (
        f"import sys, importlib; sys.path.insert(0, {str(folder)!r})\n"
        f"for name in {modules!r}: importlib.import_module(name)\n"
        f"print(*(m for m in sys.modules if m.split('.')[0] in {WEB!r}\n"
        f"        or any(m == r or m.startswith(r + '.') for r in {REST!r})))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    return done.stdout.split()


@pytest.mark.parametrize("path", sorted(ENGINE.rglob("*.py")), ids=lambda p: str(p.relative_to(ENGINE)))
def test_an_engine_module_is_clean(path):
    assert forbidden(path.read_text(encoding="utf-8")) == []


def test_importing_the_whole_engine_loads_no_web():
    modules = [
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for path in sorted(ENGINE.rglob("*.py"))
    ]
    assert "studio.engine.joints" in modules
    assert loaded_by(ROOT, modules) == []


@pytest.mark.parametrize(
    "source",
    [
        "import fastapi",
        "def f():\n    from starlette.responses import Response",
        "import viser.theme as t",
        "from studio.api import server",
        "from studio import camera",
        "import studio.take.raw",
        "import random",
        "import time\ndef f():\n    return time.time()",
        "import time as clock\nx = clock.monotonic()",
        "from time import perf_counter",
        "from datetime import datetime\nx = datetime.now()",
        "import datetime\nx = datetime.datetime.now()",
        "import numpy as np\nnp.random.seed(1)",
        "import numpy\nx = numpy.random.normal()",
        "from numpy import random\nx = random.rand(3)",
        "from numpy.random import rand",
    ],
)
def test_canary_the_guard_sees_every_kind(source):
    assert forbidden(source)


@pytest.mark.parametrize(
    "source",
    [
        "import numpy as np\nx = np.random.default_rng(1).normal()",
        "from studio.engine.errors import StudioError\nimport time_of_day",
        "class A:\n    def time(self):\n        return self.time.time()",
    ],
)
def test_the_guard_lets_clean_code_through(source):
    assert forbidden(source) == []


def test_canary_a_module_that_brings_the_web_along_is_seen(tmp_path):
    (tmp_path / "innocent.py").write_text("import helper\n")
    (tmp_path / "helper.py").write_text("import jinja2\n")
    assert forbidden((tmp_path / "innocent.py").read_text()) == []
    assert "jinja2" in loaded_by(tmp_path, ["innocent"])
