"""The wheel carries all that the program needs: installed on its own, it serves its pages."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import httpx
import pytest

from tests import patient
from tests.acceptance.processes import wait_until

ROOT = Path(__file__).parents[2]
UV = shutil.which("uv") or shutil.which("uv", path=str(ROOT / ".tools" / "uv" / "bin"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The wheel, built from the sources."""
    if UV is None:
        pytest.skip("no uv on this machine to build the wheel with")
    out = tmp_path_factory.mktemp("dist")
    subprocess.run([UV, "build", "--quiet", "--wheel", "--out-dir", out, ROOT], check=True, timeout=180)
    return next(out.glob("*.whl"))


def test_every_file_is_in_it(wheel):
    with zipfile.ZipFile(wheel) as archive:
        inside = set(archive.namelist())
    files = {path.relative_to(ROOT).as_posix() for path in (ROOT / "studio").rglob("*") if path.is_file()}
    assert {name for name in files if "__pycache__" not in name} <= inside
    assert not [name for name in inside if name.startswith(("tests/", "sessions/"))]


def follows_the_demo(client: httpx.Client) -> bool:
    """Whether both simulated cameras send, and the solver makes poses of what they see."""
    status = client.get("api/v1/status").json()
    sending = [camera["state"] == "live" for camera in status["cameras"].values()]
    return sending == [True, True] and status["pipeline"]["rate_hz"] > 1


def serve_and_look(program_of: list[str], python: str, folder: Path, environment: dict[str, str]) -> str:
    """Start the demo of an environment and fetch its page and what it is made of; return where it lies.

    The demo begins with a performer whom two simulated cameras see, without a checkout of the sources around.
    """
    command = [*program_of, "serve", "--demo", "--port", "0", "--sessions", str(folder / "sessions")]
    with subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True) as program:
        try:
            url = program.stdout.readline().split()[5]
            with patient.Client(base_url=url, timeout=60) as client:
                page = client.get("/")
                assert page.status_code == 200 and "Capture Studio" in page.text
                for path in (
                    "static/stage/main.js",
                    "static/base/studio.css",
                    "static/vendor/three/three.module.js",
                    "viewer/",
                ):
                    assert client.get(path).status_code == 200, path
                assert client.get("/health").json()["status"] == "ok"
                wait_until(lambda: follows_the_demo(client), "poses come of two simulated cameras")
        finally:
            program.terminate()
            program.wait(timeout=60)
    where = [python, "-c", "import studio; print(studio.__file__)"]
    return subprocess.run(where, cwd=folder, env=environment, capture_output=True, text=True).stdout


def keep_compiled(place: Path) -> None:
    """Give what is installed the code that numba compiled for the sources here: to compile it anew takes a minute.

    numba knows a source again by its size and time.
    """
    for source in (ROOT / "studio").rglob("*.py"):
        shutil.copystat(source, place / source.relative_to(ROOT))
    for kept in (ROOT / "studio").rglob("__pycache__/*.nb[ci]"):
        copy = place / kept.relative_to(ROOT)
        copy.parent.mkdir(exist_ok=True)
        shutil.copy(kept, copy)


def test_it_serves_its_pages(wheel, tmp_path):
    """The wheel alone, with the packages that are here already."""
    place = tmp_path / "installed"
    subprocess.run(
        [UV, "pip", "install", "--quiet", "--no-deps", "--target", place, wheel], check=True, timeout=180
    )
    keep_compiled(place)
    environment = {**os.environ, "PYTHONPATH": str(place)}
    python = sys.executable
    assert str(place) in serve_and_look([python, "-m", "studio"], python, tmp_path, environment)


@pytest.mark.long
def test_it_serves_its_pages_from_a_fresh_environment(wheel, tmp_path):
    subprocess.run(
        [UV, "venv", "--quiet", "--python", sys.executable, tmp_path / "venv"], check=True, timeout=180
    )
    folder = tmp_path / "venv" / ("Scripts" if sys.platform == "win32" else "bin")
    python = str(folder / "python")
    subprocess.run([UV, "pip", "install", "--quiet", "--python", python, wheel], check=True, timeout=600)
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    assert str(tmp_path) in serve_and_look([str(folder / "studio")], python, tmp_path, environment)
