"""Which of the files that are given at once make a take together."""

import pytest

from studio.take.library.dropped import Group, group_files


def made(*paths: str) -> dict[str, tuple[str, ...]]:
    """The paths of the files of each group without a problem, by its root."""
    return {one.root: tuple(paths[i] for i in one.files) for one in group_files(paths) if not one.problem}


def refused(*paths: str) -> list[Group]:
    return [one for one in group_files(paths) if one.problem]


def test_a_folder_of_cameras_is_one_take_with_all_that_is_in_it():
    paths = (
        "walk/camera_0/joints.csv",
        "walk/camera_1/depth.txt",
        "walk/camera_1/1.png",
        "walk/recording.json",
    )
    assert made(*paths) == {"walk": paths}


def test_a_folder_of_folders_is_searched():
    paths = (
        "mon/a/camera_0/joints.csv",
        "mon/b/camera_0/joints.csv",
        "mon/c/left.mkv",
        "mon/c/right.mkv",
        "mon/x.txt",
    )
    assert made(*paths) == {"mon/a": paths[:1], "mon/b": paths[1:2], "mon/c": paths[2:4]}
    assert refused(*paths) == []


def test_loose_recordings_of_single_cameras_are_one_take_and_others_one_each():
    paths = ("left.mkv", "right.MKV", "calibration.json", "pair.csv", "jump.bvh", "one.take.zip", "raw.mcap")
    assert made(*paths) == {"": paths[:3], **{path: (path,) for path in paths[3:]}}
    assert made("left.bag") == {"left.bag": ("left.bag",)}


def test_videos_given_together_are_the_cameras_of_one_take():
    assert list(made("left.mp4", "right.MOV").values()) == [("left.mp4", "right.MOV")]
    assert made("shoot/a.webm", "shoot/b.mp4", "shoot/notes.txt").keys() == {"shoot"}


@pytest.mark.parametrize(
    "paths",
    [
        ("shoot/left.json", "shoot/right.json", "shoot/left.mp4", "shoot/right.mp4"),
        ("shoot/left/left_0_keypoints.json", "shoot/recording.json"),
        ("shoot/pose/cam01_json/cam01_000000.json", "shoot/videos/cam01.mp4", "shoot/Config.toml"),
        ("shoot/output_data/raw_data/mediapipe_2dData_pixelXY.npy", "shoot/synchronized_videos/a.mp4"),
    ],
)
def test_landmarks_of_another_program_are_one_take_with_their_videos(paths):
    assert made(*paths) == {"shoot": paths}


def test_a_folder_that_is_a_take_is_one():
    paths = ("one/take.json", "one/raw.mcap", "one/solves/live/poses.npz")
    assert made(*paths) == {"one": paths}


def test_what_is_of_no_known_kind_is_told():
    (loose,) = refused("notes.txt")
    assert loose.problem.startswith(
        "notes.txt is no recording that can be imported; allowed: a folder with camera_K"
    )
    (folder,) = refused("holiday/a.jpg", "holiday/b/c.jpg")
    assert folder.label == "holiday" and len(folder.files) == 2
    assert [one.label for one in refused("walk.bvh", "notes.txt")] == ["notes.txt"]


@pytest.mark.parametrize(
    "path",
    ["../x.bvh", "/etc/x.bvh", "a/../../x.bvh", "a\\..\\x.bvh", "a//x.bvh", "", ".hidden.bvh", "a/.ssh/x.bvh",
     "x\0.bvh", "a:b.bvh", "x" * 201 + ".bvh", "/".join("a" * 13) + "/x.bvh", "x.bvh\n"],
)  # fmt: skip
def test_names_that_could_lead_elsewhere_are_refused(path):
    (group,) = group_files([path])
    assert "is not allowed" in group.problem


def test_models_of_robots_are_one_group_with_all_that_is_in_their_folder():
    g1 = ("g1/g1.xml", "g1/scene.xml", "g1/assets/pelvis.STL", "g1/LICENSE")
    loose = ("h1.urdf", "torso.dae", "walk.bvh")
    groups = group_files((*g1, *loose))
    assert [(one.root, one.files, one.robot) for one in groups] == [
        ("", (4, 5), True), ("walk.bvh", (6,), False), ("g1", (0, 1, 2, 3), True),
    ]  # fmt: skip
    assert made("walk/camera_0/joints.csv", "walk/settings.xml").keys() == {"walk"}
    assert len(refused("skin.stl")) == 1
