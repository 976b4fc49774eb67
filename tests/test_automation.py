"""What runs by itself, on GitHub and before a commit, names what there is."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).parents[1]
PROGRAMS = Path(sys.executable).parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
JOBS = yaml.safe_load((ROOT / ".github/workflows/test.yml").read_text(encoding="utf-8"))["jobs"]
FORMS = sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml"))
HOOKS = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"][0]["hooks"]
OWN_WORDS = {"--coverage"}
"""Arguments that ./test itself takes."""

SLOW = "tests/acceptance/test_preview.py"
"""A file that is none of the fast part, and is soon loaded."""


def commands(job: dict[str, Any]) -> list[str]:
    return [step["run"] for step in job["steps"] if "run" in step]


def test_every_python_of_the_project_is_tested_and_no_other():
    allowed = SpecifierSet(PROJECT["project"]["requires-python"])
    supported = [f"3.{minor}" for minor in range(30) if f"3.{minor}.0" in allowed]
    assert JOBS["linux"]["strategy"]["matrix"]["python"] == supported
    assert set(JOBS["fast"]["strategy"]["matrix"]["python"]) <= set(supported)
    assert JOBS["fast"]["strategy"]["matrix"]["system"] == ["macos-latest", "windows-latest"]


def test_the_workflow_s_commands_are_there():
    assert commands(JOBS["linux"]) == ["./test"]
    assert (ROOT / "test").stat().st_mode & 0o111
    for command in commands(JOBS["fast"]):
        program = re.match(r"(?:uv run --no-sync )?(\S+)", command)
        assert program and program[1] in {"python", "uv", "pytest"}
    groups = PROJECT["dependency-groups"]["dev"]
    assert all(any(line.startswith(name) for line in groups) for name in ("pytest", "pytest-xdist"))


def test_the_options_of_the_fast_part_and_of_coverage_are_known():
    known = subprocess.run(
        [PROGRAMS / "pytest", "--help"], cwd=ROOT, capture_output=True, text=True, timeout=120
    ).stdout
    script = (ROOT / "test").read_text(encoding="utf-8")
    words = " ".join(
        [*commands(JOBS["fast"])[-1:], *(line for line in script.splitlines() if "set --" in line)]
    )
    options = set(re.findall(r"--[a-z][a-z-]+", words.split("pytest", 1)[1])) - OWN_WORDS
    assert {"--fast", "--dist", "--cov", "--cov-report"} <= options
    assert not [option for option in options if option not in known]


def test_the_fast_part_is_found_and_is_not_all():
    listed = subprocess.run(
        [PROGRAMS / "pytest", "--fast", "--collect-only", "-q", "tests/test_wire.py", SLOW],
        cwd=ROOT, capture_output=True, text=True, timeout=300,
    ).stdout  # fmt: skip
    assert "tests/test_wire.py" in listed and "tests/acceptance" not in listed
    assert "deselected" in listed.splitlines()[-1]


def test_every_name_of_the_fast_part_is_there():
    from tests.conftest import FAST
    from tests.scheduling import REAL_TIME

    assert [name for name in (*FAST, *REAL_TIME) if not (ROOT / name).exists()] == []


@pytest.mark.parametrize(
    "form", [path for path in FORMS if path.stem != "config"], ids=lambda path: path.stem
)
def test_an_issue_form_is_whole(form: Path):
    content = yaml.safe_load(form.read_text(encoding="utf-8"))
    assert {"name", "description", "body"} <= set(content)
    asked = [field for field in content["body"] if field["type"] != "markdown"]
    assert len({field["id"] for field in asked}) == len(asked)
    assert all(field["type"] in ("input", "textarea") and field["attributes"]["label"] for field in asked)


def test_there_is_a_form_for_each_kind_of_issue():
    assert [path.stem for path in FORMS] == ["bug", "config", "feature", "recording"]
    assert (ROOT / ".github/pull_request_template.md").is_file()


@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
def test_a_hook_runs_a_program_of_the_environment(hook: dict[str, Any]):
    program, *_ = hook["entry"].split()
    assert hook["language"] == "system" and program.startswith(".venv/bin/")
    assert shutil.which(Path(program).name, path=str(PROGRAMS)), f"{program} is not among the packages of dev"


def hooked(folder: Path, hook: str, file: str) -> subprocess.CompletedProcess[str]:
    """Run one hook over a file of a repository of its own."""
    return subprocess.run(
        [PROGRAMS / "pre-commit", "run", hook, "--files", file], cwd=folder, capture_output=True, text=True,
        timeout=300, env={"PATH": f"{PROGRAMS}:/usr/bin:/bin", "PRE_COMMIT_HOME": str(folder / "cache")},
    )  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="the hooks name programs as POSIX systems do")
@pytest.mark.parametrize(
    ("hook", "name", "bad", "good"),
    [
        ("ruff", "a.py", "import os\n", "x = 1\n"),
        ("ruff-format", "a.py", "x=1\n", "x = 1\n"),
        ("end-of-file", "a.md", "words", "words\n"),
        ("trailing-space", "a.md", "words \n", "words\n"),
        ("yaml", "a.yml", "a: [\n", "a: []\n"),
        ("toml", "a.toml", "a = [\n", "a = []\n"),
    ],
)
def test_a_hook_lets_good_files_through_and_no_bad_one(tmp_path: Path, hook, name, bad, good):
    (tmp_path / ".venv").mkdir()
    (tmp_path / ".venv" / "bin").symlink_to(PROGRAMS)
    shutil.copy(ROOT / ".pre-commit-config.yaml", tmp_path)
    file = tmp_path / name
    file.write_text(bad)
    subprocess.run(["git", "init", "--quiet", tmp_path], check=True)
    subprocess.run(["git", "add", name, ".pre-commit-config.yaml"], cwd=tmp_path, check=True)
    done = hooked(tmp_path, hook, name)
    assert done.returncode == 1 and "Failed" in done.stdout, done.stdout + done.stderr
    file.write_text(good)
    subprocess.run(["git", "add", name], cwd=tmp_path, check=True)
    done = hooked(tmp_path, hook, name)
    assert done.returncode == 0 and "Passed" in done.stdout, done.stdout + done.stderr
