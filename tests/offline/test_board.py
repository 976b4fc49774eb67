"""Boards in videos give cameras without depth their size, floor and origin."""

import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import studio
from studio.__main__ import main
from studio.engine.base.errors import CalibrationError, SettingsError
from studio.engine.base.geometry import make_transform
from studio.engine.calibration.board import Sighting, with_board
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.seeing.board import Board, BoardFinder
from studio.engine.seeing.board_sheet import board_sheet
from studio.offline.board import calibrated_by_board
from studio.take.folder.take import Take
from tests.engine.calibration.views.synthetic import HEIGHT_M, LENS
from tests.offline.boards import A0, CAMERAS, TAG, Shown, held, lying, take_with_boards
from tests.refused import refused

APART_M = float(np.linalg.norm(CAMERAS["left"][:3, 3] - CAMERAS["right"][:3, 3]))
A1 = Board.parse("charuco:5x7:100:75")

BRIEF_S = 3.0
"""Length of takes that are refused for what their videos show."""


def wrong_calibration() -> Calibration:
    """The true cameras on a stage that is 5 % too small, with a floor 4 cm too high and turned by a degree."""
    a = np.radians(1.0)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(a), -np.sin(a)], [0.0, np.sin(a), np.cos(a)]])
    off = make_transform(turn, np.array([0.1, 0.2, -0.04]))
    moved = {name: off @ T for name, T in CAMERAS.items()}
    return Calibration(
        "left",
        {
            name: CameraCalibration(make_transform(T[:3, :3], 0.95 * T[:3, 3]), lens=LENS)
            for name, T in moved.items()
        },
    )


def sightings(*shown: Shown) -> list[Sighting]:
    rng, out = np.random.default_rng(0), []
    for board in shown:
        finder = BoardFinder(board.board)
        for name, T in CAMERAS.items():
            found = finder.find(board.seen_by(T, rng)[..., 0])
            out += [Sighting(name, instant, seen) for seen in found for instant in range(3)]
    return out


def apart_m(calibration: Calibration) -> float:
    left, right = (calibration.cameras[name].T_stage_camera[:3, 3] for name in CAMERAS)
    return float(np.linalg.norm(left - right))


@pytest.mark.parametrize(
    ("shown", "raised_m"),
    [
        ([Shown(A0, lying(0.3, 0.2, 30.0))], 0.02),
        ([Shown(A0, lying(0.3, 0.2, 30.0), old=True)], 0.02),
        ([Shown(TAG, lying(x, y, 10.0), number=n) for n, x, y in ((3, 0.5, 0.4), (5, -0.6, -0.3))], 0.04),
    ],
)
def test_a_board_on_the_floor_gives_size_floor_and_origin(shown: list[Shown], raised_m: float) -> None:
    found, said = with_board(wrong_calibration(), sightings(*shown))
    assert said.on_floor and said.cameras == ("left", "right")
    assert apart_m(found) == pytest.approx(APART_M, rel=0.01)
    assert said.size == pytest.approx(1.0 / 0.95, rel=0.01)
    middle = shown[0].T_stage_board[:3, 3]
    for name, T in CAMERAS.items():
        place = found.cameras[name].T_stage_camera[:3, 3]
        assert place[2] == pytest.approx(T[2, 3], abs=raised_m)
        assert np.linalg.norm(place[:2]) == pytest.approx(np.linalg.norm((T[:3, 3] - middle)[:2]), rel=0.01)


@pytest.mark.parametrize("board", [A1, TAG])
def test_a_board_that_is_held_gives_the_size_alone(board: Board) -> None:
    before = wrong_calibration()
    found, said = with_board(before, sightings(Shown(board, held())))
    assert not said.on_floor and said.size == pytest.approx(1.0 / 0.95, rel=0.01)
    for name, camera in before.cameras.items():
        after = found.cameras[name].T_stage_camera
        np.testing.assert_allclose(after[:3, :3], camera.T_stage_camera[:3, :3])
        np.testing.assert_allclose(after[:3, 3], said.size * camera.T_stage_camera[:3, 3])


@pytest.mark.parametrize(("text", "number"), [("charuco:5x7:60:45", 0), ("apriltag:160:25h9", 7)])
def test_a_sheet_shows_the_board_in_true_size(text: str, number: int) -> None:
    board, sheet = Board.parse(text), ElementTree.fromstring(board_sheet(Board.parse(text), number))
    left, top, wide, high = (float(value) for value in sheet.attrib["viewBox"].split())
    assert sheet.attrib["width"] == f"{wide:.3f}mm"
    picture = np.full((round(4 * high), round(4 * wide)), 255, np.uint8)  # 4 pixels a millimetre
    drawn = sheet.find("{*}path").attrib["d"]  # type: ignore[union-attr]
    for x, y, side in re.findall(r"M(-?[\d.]+) (-?[\d.]+)h([\d.]+)", drawn):
        x0, y0 = 4 * (float(x) - left), 4 * (float(y) - top)
        picture[round(y0) : round(y0 + 4 * float(side)), round(x0) : round(x0 + 4 * float(side))] = 0
    (seen,) = BoardFinder(board).find(picture)
    assert seen.number == number and len(seen.ids) == (24 if board.kind == "charuco" else 4)
    apart_mm = np.linalg.norm(np.diff(seen.pixels[[0, -1]], axis=0)) / 4
    assert apart_mm == pytest.approx(1e3 * np.linalg.norm(np.diff(seen.points[[0, -1]], axis=0)), abs=1.0)


def test_a_picture_with_markers_of_another_board_counts_once() -> None:
    finder = BoardFinder(Board.parse("charuco:9x6:200:150"))
    picture = Shown(A0, lying(0.3, 0.2, 30.0)).seen_by(CAMERAS["left"], np.random.default_rng(0))
    assert finder.find(picture[..., 0]) == [] and finder.markers == 1


def test_no_sheet_has_a_tag_or_markers_that_do_not_exist() -> None:
    with refused(SettingsError, "value.bad"):
        board_sheet(Board.parse("apriltag:160:16h5"), 30)
    with refused(SettingsError, "board.few_markers"):
        Board.parse("charuco:20x20:60:45")


def test_sizes_that_contradict_each_other_and_cameras_side_by_side_are_refused() -> None:
    seen = sightings(Shown(A1, held()))
    bent = [
        replace(one, instant=k, seen=replace(one.seen, points=one.seen.points * by))
        for k, by in enumerate((0.8, 1.0, 1.2, 1.4))
        for one in seen
    ]
    with refused(CalibrationError, "board.contradicts"):
        with_board(wrong_calibration(), bent)
    alone = [replace(one, instant=list(CAMERAS).index(one.camera)) for one in seen]
    with refused(CalibrationError, "board.not_together"):
        with_board(wrong_calibration(), alone)


def test_a_take_is_calibrated_by_its_board(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shown = [Shown(A0, lying(0.3, 0.2, 30.0))]
    take = take_with_boards(tmp_path / "s" / "take", {name: shown for name in CAMERAS})
    assert main(["calibrate", str(take.path), "--board", "charuco:4x5:200:150"]) == 0
    printed = capsys.readouterr().out
    seen = re.search(r"board: seen by left, right (\d+) times together; .* floor and origin by it", printed)
    assert seen is not None and int(seen[1]) > 10
    found = studio.open_take(take.path).calibration()
    assert found.performer is not None and found.performer.height_m == pytest.approx(HEIGHT_M, rel=0.02)
    assert apart_m(found) == pytest.approx(APART_M, rel=0.02)
    for name, T in CAMERAS.items():
        assert found.cameras[name].T_stage_camera[2, 3] == pytest.approx(T[2, 3], abs=0.06)
    assert not any("size of the stage is a guess" in one for one in found.reasons())
    with refused(CalibrationError, "board.height_differs"):
        calibrated_by_board(take, wrong_calibration(), Board.parse("charuco:4x5:160:120"), height_m=HEIGHT_M)
    with refused(CalibrationError, "board.no_human"):
        calibrated_by_board(take, wrong_calibration(), Board.parse("charuco:4x5:400:300"))


@pytest.fixture(scope="module")
def one_sees(tmp_path_factory: pytest.TempPathFactory) -> Take:
    """A take in which only one camera sees a board."""
    folder = tmp_path_factory.mktemp("boards") / "s" / "take"
    return take_with_boards(folder, {"left": [Shown(A0, lying(0.0, 0.0, 0.0))], "right": []}, BRIEF_S)


@pytest.mark.parametrize(
    ("board", "code"),
    [
        ("charuco:4x5:200:150", "board.one_camera"),
        ("charuco:9x6:200:150", "board.no_corners"),
        ("charuco:4x5:200:150:5x5_100", "board.other_markers"),
        ("apriltag:200:25h9", "board.other_markers"),
    ],
)
def test_a_board_that_is_not_as_said_is_refused(one_sees: Take, board: str, code: str) -> None:
    with refused(CalibrationError, code):
        calibrated_by_board(one_sees, wrong_calibration(), Board.parse(board))


def test_videos_without_a_board_and_takes_without_videos_are_refused(tmp_path: Path) -> None:
    none = take_with_boards(tmp_path / "s" / "none", {"left": [], "right": []}, BRIEF_S)
    with refused(CalibrationError, "board.not_found"):
        calibrated_by_board(none, wrong_calibration(), A0)
    one = take_with_boards(tmp_path / "s" / "one", {"left": []}, BRIEF_S)
    with refused(SettingsError, "board.no_videos"):
        calibrated_by_board(one, wrong_calibration(), A0)
    deep = replace(wrong_calibration(), cameras={"left": CameraCalibration(np.eye(4))})
    with refused(SettingsError, "board.depth"):
        calibrated_by_board(none, deep, A0)


@pytest.mark.parametrize(
    "text",
    [
        "", "charuco", "charuco:5x7", "charuco:5x7:60", "charuco:5x7:45:60", "charuco:5:60:45", "charuco:2x7:60:45",
        "charuco:5x7:60:45:9x9_50", "apriltag", "apriltag:nan", "apriltag:-160", "apriltag:160:no", "chess:5x7:60:45",
    ],
)  # fmt: skip
def test_a_text_that_is_no_board_says_what_is_allowed(text: str) -> None:
    with pytest.raises(SettingsError, match="charuco:COLUMNSxROWS"):
        Board.parse(text)
