"""The performer's body knows nothing of the tracker's or the solver's model, nor they of it.

Every source file is read as a syntax tree, and the modules are really imported; canaries prove that both notice.
"""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[4]
SIMULATOR = ROOT / "studio" / "camera" / "simulator" / "depth"
MODELS = ("studio.engine.tracker", "studio.engine.human", "studio.engine.hands", "studio.engine.solve",
          "studio.engine.fusion", "studio.camera.simulator.occlusion")  # fmt: skip
BODY = "studio.camera.simulator.depth"
TABLES = ("studio.engine.motion.body.AUTHORED_OFFSETS", "studio.engine.motion.torture.TORTURE_OFFSETS")


def imported(source: str) -> set[str]:
    """Return all dotted names that a source file imports, at any depth of the file."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def touches(source: str, forbidden: tuple[str, ...]) -> set[str]:
    return {
        name for name in imported(source) if any(name == f or name.startswith(f + ".") for f in forbidden)
    }


def loaded_by(folder: Path, modules: list[str], forbidden: tuple[str, ...]) -> list[str]:
    code = (
        f"import sys, importlib; sys.path[:0] = [{str(folder)!r}, {str(ROOT)!r}]\n"
        f"for name in {modules!r}: importlib.import_module(name)\n"
        f"print(*(m for m in sys.modules if any(m == f or m.startswith(f + '.') for f in {forbidden!r})))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    return done.stdout.split()


@pytest.mark.parametrize("path", sorted(SIMULATOR.glob("*.py")), ids=lambda p: p.stem)
def test_the_body_imports_no_model(path):
    assert touches(path.read_text(encoding="utf-8"), (*MODELS, *TABLES)) == set()


@pytest.mark.parametrize("package", ["tracker", "human", "hands"])
def test_no_model_imports_the_body(package):
    for path in (ROOT / "studio" / "engine" / package).glob("*.py"):
        assert touches(path.read_text(encoding="utf-8"), (BODY,)) == set()


def test_importing_the_simulator_loads_no_model():
    modules = [f"{BODY}.{path.stem}" for path in sorted(SIMULATOR.glob("*.py")) if path.stem != "__init__"]
    assert f"{BODY}.body" in modules
    assert loaded_by(ROOT, modules, tuple(name for name in MODELS if name.startswith("studio.engine"))) == []


@pytest.mark.parametrize(
    "source",
    [
        "import studio.engine.tracker",
        "from studio.engine.tracker.body import CAPSULES",
        "from studio.engine import human",
        "def f():\n    from studio.camera.simulator.occlusion import hidden_joints",
        "from studio.engine.motion.body import AUTHORED_OFFSETS",
    ],
)
def test_canary_the_guard_sees_an_import(source):
    assert touches(source, (*MODELS, *TABLES))


def test_canary_a_module_that_brings_a_model_along_is_seen(tmp_path):
    (tmp_path / "innocent.py").write_text("import helper\n")
    (tmp_path / "helper.py").write_text("import studio.engine.human.skeleton\n")
    assert touches((tmp_path / "innocent.py").read_text(), MODELS) == set()
    assert "studio.engine.human.skeleton" in loaded_by(tmp_path, ["innocent"], MODELS)
