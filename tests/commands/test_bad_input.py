"""Bad input: one clear line, the right exit code, nothing half-written."""

import shutil
from pathlib import Path

import pytest

from tests.commands.program import one_line, studio, studio_process

MOTION = "mocap/02_01.bvh"
JOINTS = "noisy_joints/jumps_2_cameras"


def tree(folder: Path) -> list[str]:
    """Every file and folder below, hidden ones too."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


@pytest.fixture(scope="session")
def short_recording(test_data, tmp_path_factory) -> Path:
    """The first 6 seconds of a recording of two cameras."""
    source, folder = test_data / JOINTS, tmp_path_factory.mktemp("recordings") / "short"
    for camera in ("camera_0", "camera_1"):
        (folder / camera).mkdir(parents=True)
        with open(source / camera / "joints.csv") as file:
            (folder / camera / "joints.csv").write_text("".join(next(file) for _ in range(180)))
    return folder


@pytest.fixture(scope="session")
def short_take(short_recording, tmp_path_factory) -> Path:
    """The same as a take without a calibration."""
    folder = tmp_path_factory.mktemp("takes")
    done = studio_process("import", short_recording, "--out", "short", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "short"


@pytest.fixture
def take(short_take, tmp_path) -> Path:
    """A copy that a test may do with as it likes."""
    return Path(shutil.copytree(short_take, tmp_path / "take"))


def test_a_csv_with_missing_columns(short_recording, tmp_path):
    folder = Path(shutil.copytree(short_recording, tmp_path / "broken"))
    csv = folder / "camera_1" / "joints.csv"
    csv.write_text(csv.read_text().replace("left_wrist_y", "left_wrist_q"))
    line = one_line(studio("import", "broken", "--out", "take", cwd=tmp_path), 1)
    assert "left_wrist" in line
    assert str(Path("camera_1") / "joints.csv") in line
    assert not (tmp_path / "take").exists()
    assert [name for name in tree(tmp_path) if not name.startswith("broken")] == []


def test_a_csv_that_is_cut_off(short_recording, tmp_path):
    folder = Path(shutil.copytree(short_recording, tmp_path / "broken"))
    csv = folder / "camera_0" / "joints.csv"
    csv.write_bytes(csv.read_bytes()[:-100])
    line = one_line(studio("import", "broken", "--out", "takes/take", cwd=tmp_path), 1)
    assert "joints.csv:180" in line
    assert [name for name in tree(tmp_path) if not name.startswith("broken")] == []


def test_a_bvh_that_is_cut_off(test_data, tmp_path):
    text = (test_data / MOTION).read_text()
    (tmp_path / "cut.bvh").write_text(text[: len(text) // 2])
    line = one_line(studio("simulate", "cut.bvh", "--out", "take", cwd=tmp_path), 1)
    assert "cut.bvh" in line
    assert tree(tmp_path) == ["cut.bvh"]


def test_what_is_no_recording(tmp_path):
    (tmp_path / "notes.txt").write_text("hello")
    assert "notes.txt" in one_line(studio("import", "notes.txt", "--out", "take", cwd=tmp_path), 1)
    assert "nothing.csv" in one_line(studio("import", "nothing.csv", "--out", "take", cwd=tmp_path), 1)
    assert tree(tmp_path) == ["notes.txt"]


def test_an_existing_take_is_not_overwritten(short_recording, take):
    before = (take / "raw.mcap").read_bytes()
    line = one_line(studio("import", short_recording, "--out", take, cwd=take.parent), 1)
    assert "not empty" in line
    assert (take / "raw.mcap").read_bytes() == before


def test_a_take_without_calibration(take):
    before = tree(take)
    line = one_line(studio_process("solve", take, cwd=take.parent), 1)
    assert "studio calibrate" in line
    assert tree(take) == before


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--set", "colour=blue"), "allowed: cameras"),
        (("--set", "fusion=median"), "allowed: mean, robust"),
        (("--set", "flexibility=3"), "from 0 to 2"),
        (("--set", "fusion"), "KEY=VALUE"),
        (("--preset", "best"), "allowed: raw, thesis, studio, finish"),
    ],
)
def test_an_unknown_setting_lists_what_is_allowed(take, arguments, says):
    before = tree(take)
    assert says in one_line(studio("solve", take, *arguments, cwd=take.parent), 2)
    assert tree(take) == before


def test_physics_without_finishing(take):
    assert "preset finish" in one_line(studio("solve", take, "--set", "physics=on", cwd=take.parent), 2)


def test_a_solve_name_that_leaves_the_take(take):
    done = studio("solve", take, "--name", "../../out", cwd=take.parent)
    assert "not allowed" in one_line(done, 1)
    assert [path.name for path in take.parent.iterdir()] == ["take"]


def test_a_folder_that_is_no_take(tmp_path):
    (tmp_path / "empty").mkdir()
    for command in (("calibrate",), ("solve",), ("evaluate", "--reference", "x.csv"),
                    ("export", "--format", "bvh", "--out", "x.bvh"), ("picture", "--out", "x.png")):  # fmt: skip
        line = one_line(studio(command[0], "empty", *command[1:], cwd=tmp_path), 1)
        assert "no take at" in line
    assert tree(tmp_path) == ["empty"]


def test_a_take_without_solves(take):
    for command in (
        ("evaluate", take, "--reference", "x.csv"),
        ("export", take, "--format", "bvh", "--out", "x.bvh"),
    ):
        assert "studio solve" in one_line(studio(*command, cwd=take.parent), 1)
    assert not (take.parent / "x.bvh").exists()


def test_a_take_json_of_another_version(take):
    file = take / "take.json"
    file.write_text(file.read_text().replace('"format_version": 1', '"format_version": 9'))
    assert "version" in one_line(studio("solve", take, cwd=take.parent), 1)


def test_a_take_without_raw_frames(take):
    (take / "raw.mcap").unlink()
    assert "raw.mcap" in one_line(studio("calibrate", take, cwd=take.parent), 1)


def test_a_study_says_what_is_wrong(tmp_path):
    assert "no motion at none.bvh" in one_line(studio("study", "none.bvh", "--out", "s", cwd=tmp_path), 1)
    assert "--seeds 0" in one_line(studio("study", "--seeds", "0", "--out", "s", cwd=tmp_path), 2)
    assert "allowed are" in one_line(studio("study", "--cameras", "5", "--out", "s", cwd=tmp_path), 2)
    (tmp_path / "blind").mkdir()
    done = studio("study", "--votes", "blind", "--out", "s", cwd=tmp_path)
    assert "no blind test" in one_line(done, 1)
