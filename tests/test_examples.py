"""The programs in `examples/` run as they stand: the first makes a take, the others have a short one."""

import subprocess
import sys
from pathlib import Path

import pytest

import studio
from tests import patient
from tests.simulator.short_demo import short_demo
from tests.web.stages import serving, until
from tests.web.test_page import studio as serve

EXAMPLES = Path(__file__).parents[1] / "examples"
NAMES = {path.name for path in EXAMPLES.glob("*.py")}


def run(name: str, *arguments: object) -> str:
    """Return what an example prints."""
    command = [sys.executable, str(EXAMPLES / name), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


@pytest.fixture(scope="module")
def out(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("examples")
    told = run("first_solve.py", folder)
    assert "camera_1: good" in told
    assert (folder / "performer.fbx").stat().st_size > 1e6
    return folder


@pytest.fixture(scope="module")
def short(tmp_path_factory) -> Path:
    """A take like that of the first example, of some seconds after the calibration, with its solve."""
    path = tmp_path_factory.mktemp("examples") / "takes" / "short"
    path.parent.mkdir()
    with short_demo(SECONDS):
        take = studio.simulate("demo", path, cameras=2, seed=1)
    studio.calibrate(take)
    studio.solve(take, "studio")
    return path


SECONDS = 3.0
CALIBRATION_S = 33.0
"""How long the embedded performer walks before, for the calibration."""


def test_a_first_solve(out):
    poses = studio.load_poses(studio.open_take(out / "take"), "studio")
    wrist = poses.positions_m[:, poses.joint_names.index("LeftHand")]
    assert poses.frames_per_second == pytest.approx(60)
    assert 1.8 < wrist[:, 2].max() < 2.3


def test_a_batch_over_a_folder(short, tmp_path):
    told = run("batch.py", short.parent, tmp_path / "bvh")
    assert 0.95 < int(told.split()[1]) / (60 * SECONDS) < 1.05
    assert told.startswith("short: ") and " frames, " in told
    assert (tmp_path / "bvh" / "short.bvh").read_text(encoding="ascii").startswith("HIERARCHY")


def test_a_pinned_wrist_and_its_undo(short):
    told = run("edits.py", short).splitlines()
    assert told[0] == "revision 1: ['e1']" and told[2] == "revision 2: []"
    assert float(told[1].split()[-2]) == pytest.approx(5.0, abs=2.0)


def test_an_own_filter_changes_the_solve(short):
    told = run("own_filter.py", short).splitlines()
    jerks = [float(line.split()[-2]) for line in told]
    assert [line.partition(":")[0] for line in told] == ["smoothing=none", "smoothing=median_of_three"]
    assert jerks[0] != jerks[1]
    kept = (short / "solves" / "median_of_three_after" / "settings.json").read_text(encoding="utf-8")
    assert "median_of_three:after" in kept


def test_frames_from_a_socket_are_solved_as_a_take_is(short):
    told = run("live_from_socket.py", short).splitlines()
    frames, poses = (int(word) for word in told[-1].split() if word.isdigit())
    assert frames > 0.935 * 60 * (CALIBRATION_S + SECONDS)
    assert poses >= frames - 10
    assert "head at" in told[0]


def test_a_camera_of_ones_own(tmp_path):
    with serve(tmp_path) as (app, _), serving(app) as url:
        assert "the camera has ended" in run("own_camera.py", url, 60)

        def camera() -> dict[str, object]:
            return patient.get(f"{url}/api/v1/status").json()["cameras"]["waving"]

        assert camera()["device"] == "an example"
        until(lambda: camera()["frames"] == 60)  # the status is a fifth of a second old at most


def test_a_comparison_as_a_plot(short, tmp_path):
    picture = tmp_path / "comparison.png"
    told = run("compare.py", short, short.with_name("short.truth.csv"), picture)
    errors = [float(part.split()[-2]) for part in told.partition(": ")[2].split(", ")]
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert max(errors[1:]) < errors[0]


def test_every_example_is_in_the_index_and_documented():
    index = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    for name in NAMES:
        assert f"`{name}" in index
        text = (EXAMPLES / name).read_text(encoding="utf-8")
        assert text.startswith('"""') and f"python examples/{name}" in text
        assert "import studio\n" in text and "from studio" not in text
