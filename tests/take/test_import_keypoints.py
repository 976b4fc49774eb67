"""Landmarks of other programs become a take."""

import json
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS
from studio.take.importers import import_recording
from studio.take.importers.keypoint_folders import PLACES
from tests.refused import refused
from tests.take.test_import_videos import landmarks
from tests.take.video_files import write_video

NAMES = JOINT_SETS["mediapipe"]
SAYS = {"frames_per_second": 50, "image_size": [1920, 1080]}


def person(count: int, shift: float = 0.0) -> dict:
    """Points that say their own number: x = 100 + 2 k, y = 200 + 3 k."""
    points = [[100.0 + 2 * k + shift, 200.0 + 3 * k, 0.9] for k in range(count)]
    return {"person_id": [-1], "pose_keypoints_2d": [value for point in points for value in point]}


def write(folder: Path, frames: list[list[dict]]) -> None:
    folder.mkdir(parents=True)
    for k, people in enumerate(frames):
        file = folder / f"{folder.name}_{k:012d}_keypoints.json"
        file.write_text(json.dumps({"version": 1.3, "people": people}), encoding="utf-8")


@pytest.mark.parametrize("count", PLACES)
def test_every_kind_of_points_is_known(tmp_path, count):
    write(tmp_path / "in" / "cam_1_json", [[person(count)], []])
    write(tmp_path / "in" / "cam_2_json", [[person(count)], [person(count, 5.0)]])
    (tmp_path / "in" / "recording.json").write_text(json.dumps(SAYS), encoding="utf-8")
    found = landmarks(import_recording(tmp_path / "in", tmp_path / "take"))
    assert found.keys() == {"cam_1", "cam_2"}
    assert [time_ns for time_ns, *_ in found["cam_2"]] == [0, 20_000_000]
    _, message, seen = found["cam_1"][0]
    assert (message.width, message.height) == (1920, 1080) and seen.world_m is None
    for name, place in PLACES[count].items():
        np.testing.assert_allclose(seen.pixels[NAMES.index(name)], [100 + 2 * place, 200 + 3 * place])
    unknown = [k for k, name in enumerate(NAMES) if name not in PLACES[count]]
    assert np.isnan(seen.pixels[unknown]).all() and np.isnan(found["cam_1"][1][2].pixels).all()


def test_a_project_of_pose2sim_has_the_times_of_its_videos(tmp_path):
    project = tmp_path / "project"
    write(project / "pose" / "cam01_json", [[person(26)]] * 3)
    (project / "videos").mkdir()
    picture = np.full((240, 320, 3), 90, np.uint8)
    write_video(project / "videos" / "cam01.mp4", [picture] * 3, [0, 16, 50])
    ((name, frames),) = landmarks(import_recording(project, tmp_path / "take")).items()
    assert name == "cam01" and [time_ns // 1_000_000 for time_ns, *_ in frames] == [0, 16, 50]
    assert (frames[0][1].width, frames[0][1].height) == (320, 240)


def test_of_several_people_one_is_followed(tmp_path):
    """Nearest to the middle at first, then to where they were."""
    near, far = person(25, 700.0), person(25)
    write(tmp_path / "in" / "cam", [[far, near], [near, far], [far, person(25, 640.0)]])
    (tmp_path / "in" / "recording.json").write_text(json.dumps(SAYS), encoding="utf-8")
    take = import_recording(tmp_path / "in", tmp_path / "take")
    assert [seen.pixels[0, 0] for *_, seen in landmarks(take)["cam"]] == [800, 800, 740]
    assert "up to 2 people" in take.meta["notes"]


def test_what_cannot_be_read_is_said(tmp_path):
    folder = tmp_path / "in"
    write(folder / "cam", [[person(25)]])
    with refused(FormatError, "import.keypoints_no_video"):
        import_recording(folder, tmp_path / "take")
    (folder / "recording.json").write_text('{"frames_per_second": 0, "image_size": [1, 2]}', encoding="utf-8")
    with refused(FormatError, "import.keypoints_no_video"):
        import_recording(folder, tmp_path / "take")
    (folder / "recording.json").write_text(json.dumps(SAYS), encoding="utf-8")
    broken = folder / "cam" / "cam_000000000001_keypoints.json"
    for text, code in (
        ('{"people": [{"pose_keypoints_2d": [1, 2]}]}', "import.keypoints_broken"),
        ('{"people": 3}', "import.keypoints_broken"),
        (json.dumps({"people": [person(19)]}), "import.keypoints_kind"),
    ):
        broken.write_text(text, encoding="utf-8")
        with refused(FormatError, code):
            import_recording(folder, tmp_path / "take")
    assert not (tmp_path / "take").exists()
