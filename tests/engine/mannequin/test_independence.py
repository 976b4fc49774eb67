"""The mannequin's shapes are its own: it shares no table with the tracker's model or the depth simulator's body."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
MANNEQUIN = ROOT / "studio" / "engine" / "mannequin"
MODELS = ("studio.engine.tracker", "studio.engine.human", "studio.camera", "studio.render",
          "studio.engine.calibration", "studio.engine.motion")  # fmt: skip
USERS = ("engine/tracker", "engine/human", "engine/solve", "camera/simulator")


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


def loaded_by(folder: Path, module: str) -> list[str]:
    """Return the forbidden modules that importing one brings along, in a fresh interpreter."""
    code = (
        f"import sys, importlib; sys.path[:0] = [{str(folder)!r}, {str(ROOT)!r}]\n"
        f"importlib.import_module({module!r})\n"
        f"print(*(m for m in sys.modules if any(m == f or m.startswith(f + '.') for f in {MODELS!r})))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    return done.stdout.split()


@pytest.mark.parametrize("path", sorted(MANNEQUIN.glob("*.py")), ids=lambda p: p.stem)
def test_the_mannequin_imports_no_model(path):
    assert touches(path.read_text(encoding="utf-8"), MODELS) == set()


def test_importing_the_mannequin_loads_no_model():
    assert loaded_by(ROOT, "studio.engine.mannequin") == []


@pytest.mark.parametrize("folder", USERS)
def test_no_model_imports_the_mannequin(folder):
    paths = sorted((ROOT / "studio" / folder).rglob("*.py"))
    assert paths
    for path in paths:
        assert touches(path.read_text(encoding="utf-8"), ("studio.engine.mannequin",)) == set()


@pytest.mark.parametrize(
    "source",
    [
        "import studio.engine.tracker",
        "from studio.engine.tracker.body import CONES",
        "def f():\n    from studio.camera.simulator.depth.body import build",
        "from studio.engine.motion.body import AUTHORED_OFFSETS",
    ],
)
def test_canary_the_guard_sees_an_import(source):
    assert touches(source, MODELS)


def test_canary_a_module_that_brings_a_model_along_is_seen(tmp_path):
    (tmp_path / "innocent.py").write_text("import helper\n")
    (tmp_path / "helper.py").write_text("import studio.engine.human.skeleton\n")
    assert touches((tmp_path / "innocent.py").read_text(), MODELS) == set()
    assert "studio.engine.human.skeleton" in loaded_by(tmp_path, "innocent")
