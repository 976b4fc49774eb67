"""Landmarks of other programs become a take."""

import json
from pathlib import Path

import numpy as np
import pytest

from studio.engine.base.errors import FormatError
from studio.engine.model.joints import JOINT_SETS
from studio.take.importers import import_recording
from studio.take.importers.keypoints.points import PLACES
from tests.refused import refused
from tests.take.test_import_videos import landmarks
from tests.take.video_files import real_pictures, write_video

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
    """Of two who are there for as long, who is nearest to the middle."""
    near, far = person(25, 700.0), person(25)
    write(tmp_path / "in" / "cam", [[far, near], [near, far], [far, person(25, 680.0)]])
    (tmp_path / "in" / "recording.json").write_text(json.dumps(SAYS), encoding="utf-8")
    take = import_recording(tmp_path / "in", tmp_path / "take")
    assert [seen.pixels[0, 0] for *_, seen in landmarks(take)["cam"]] == [800, 800, 780]
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


def instance(points: np.ndarray) -> dict:
    """A person as MMPose writes it."""
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    return {
        "keypoints": points[:, :2].tolist(),
        "keypoint_scores": points[:, 2].tolist(),
        "bbox": [[*low.tolist(), *high.tolist()]],
        "bbox_score": 0.9,
    }


def points(count: int, shift: float = 0.0) -> np.ndarray:
    return np.array(person(count, shift)["pose_keypoints_2d"]).reshape(-1, 3)


def mmpose_frames(count: int) -> list[list[dict]]:
    return [[instance(points(count))], [], [instance(points(count, 4.0)), instance(points(count, 900.0))]]


@pytest.mark.parametrize("count", [17, 26, 133])
@pytest.mark.parametrize("form", ["inferencer", "demo", "pictures"])
def test_mmpose_is_read_in_all_its_forms(tmp_path, count, form):
    folder, frames = tmp_path / "in", mmpose_frames(count)
    folder.mkdir()
    if form == "inferencer":
        content: object = [{"frame_id": k, "instances": one} for k, one in enumerate(frames)]
        (folder / "left.json").write_text(json.dumps(content), encoding="utf-8")
    elif form == "demo":
        content = {
            "meta_info": {"dataset_name": "coco", "num_keypoints": count},
            "instance_info": [{"frame_id": k + 1, "instances": one} for k, one in enumerate(frames)],
        }
        (folder / "results_left.json").write_text(json.dumps(content), encoding="utf-8")
    else:
        (folder / "left").mkdir()
        for k, one in enumerate(frames):
            (folder / "left" / f"{k:06d}.json").write_text(json.dumps(one), encoding="utf-8")
    picture = np.full((240, 320, 3), 90, np.uint8)
    write_video(folder / "left.mp4", [picture] * 3, [0, 20, 45])
    take = import_recording(folder, tmp_path / "take", model="lite")
    ((name, found),) = landmarks(take).items()
    assert name == "left" and [time_ns // 1_000_000 for time_ns, *_ in found] == [0, 20, 45]
    nose, hip = NAMES.index("nose"), NAMES.index("left_hip")
    np.testing.assert_allclose(found[0][2].pixels[[nose, hip]], [[100, 200], [122, 233]])
    assert np.isnan(found[1][2].pixels).all() and found[2][2].pixels[nose, 0] == 104
    assert ("no heels and toes" in take.meta["notes"]) == (count == 17)
    assert "up to 2 people" in take.meta["notes"]


def test_alphapose_is_read(tmp_path):
    folder = tmp_path / "in" / "left"
    folder.mkdir(parents=True)
    people = [
        {
            "image_id": f"{k}.jpg",
            "category_id": 1,
            "keypoints": points(26, 3.0 * k).ravel().tolist(),
            "score": 2.9,
        }
        for k in (0, 1, 1, 3)
    ]
    (folder / "alphapose-results.json").write_text(json.dumps(people), encoding="utf-8")
    (tmp_path / "in" / "recording.json").write_text(json.dumps(SAYS), encoding="utf-8")
    take = import_recording(tmp_path / "in", tmp_path / "take")
    found = landmarks(take)["left"]
    assert [time_ns for time_ns, *_ in found] == [0, 20_000_000, 60_000_000]
    assert [seen.pixels[0, 0] for *_, seen in found] == [100, 103, 109]
    assert "cannot be calibrated" in take.meta["notes"]


def test_freemocap_is_read(tmp_path):
    """Its cameras are in the order of their videos, which are of one clock."""
    folder = tmp_path / "in"
    raw, videos = folder / "output_data" / "raw_data", folder / "synchronized_videos"
    raw.mkdir(parents=True)
    videos.mkdir()
    shown = np.full((2, 3, 543, 2), np.nan)
    shown[0, :, :33], shown[1, 1:, :33] = 50.0, 70.0
    np.save(raw / "mediapipe_2dData_numCams_numFrames_numTrackedPoints_pixelXY.npy", shown)
    picture = np.full((240, 320, 3), 90, np.uint8)
    for name in ("Camera_001", "Camera_000"):
        write_video(videos / f"{name}_synchronized.mp4", [picture] * 3)
    (folder / "in_camera_calibration.toml").write_text('[cam_0]\nname = "0"\n', encoding="utf-8")
    take = import_recording(folder, tmp_path / "take", model="lite")
    found = landmarks(take)
    assert [*found] == ["Camera_000_synchronized", "Camera_001_synchronized"]
    first, second = found.values()
    assert first[0][2].pixels[0, 0] == 50 and np.isnan(second[0][2].pixels).all()
    assert second[1][2].pixels[32, 1] == 70 and take.common_clocks().keys() == found.keys()
    assert "in_camera_calibration.toml was left" in take.meta["notes"]


def test_the_body_is_guessed_in_the_video_beside(tmp_path, test_data):
    """Landmarks of a picture alone do not say how the body stands; the studio's own network does."""
    real = real_pictures(test_data / "rgb" / "pose2sim_single", "cam01", 2)
    (tmp_path / "own").mkdir()
    write_video(tmp_path / "own" / "cam.mp4", real)
    own = landmarks(import_recording(tmp_path / "own", tmp_path / "a"))["cam"]
    folder = tmp_path / "in"
    folder.mkdir()
    write_video(folder / "cam.mp4", real)
    body = [NAMES.index(name) for name in PLACES[17]]
    frames = []
    for k, (*_, seen) in enumerate(own):
        there = np.column_stack([seen.pixels[body], np.full(17, 0.8)])
        frames.append({"frame_id": k, "instances": [instance(there + (0 if k == 0 else [150, 0, 0]))]})
    (folder / "cam.json").write_text(json.dumps(frames), encoding="utf-8")
    here, elsewhere = landmarks(import_recording(folder, tmp_path / "b"))["cam"]
    np.testing.assert_allclose(here[2].world_m, own[0][2].world_m)
    assert elsewhere[2].world_m is None or np.isnan(elsewhere[2].world_m).all()


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (
            '[{"frame_id": 0, "instances": [{"keypoints": [[1, 2]], "keypoint_scores": [1, 1]}]}]',
            "keypoints_broken",
        ),
        ('[{"frame_id": 0, "instances": [{"keypoints": "none"}]}]', "keypoints_broken"),
        ('{"meta_info": 3, "predictions": 4}', "keypoints_broken"),
        ('[{"image_id": "one.jpg", "keypoints": [1, 2, 3]}]', "keypoints_broken"),
        (
            '[{"frame_id": 0, "instances": [{"keypoints": [[1, 2]], "keypoint_scores": [1]}]}]',
            "keypoints_kind",
        ),
    ],
)
def test_broken_json_of_mmpose_is_said(tmp_path, text, code):
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "recording.json").write_text(json.dumps(SAYS), encoding="utf-8")
    (folder / "cam.json").write_text(text, encoding="utf-8")
    with refused(FormatError, f"import.{code}"):
        import_recording(folder, tmp_path / "take")
