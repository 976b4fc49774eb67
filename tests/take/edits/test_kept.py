"""`edits.json` of a take: what it holds, files that cannot be read, and edits that are not allowed."""

import json
import math

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, TakeError
from studio.engine.edits.edit import (
    ContactEdit,
    DirectionEdit,
    ExchangeEdit,
    LeaveOutEdit,
    OffsetEdit,
    PinEdit,
    RetimeEdit,
    TrimEdit,
)
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.take.edits.carry import edits_of_solve
from studio.take.edits.change import change_edits
from studio.take.edits.kept import edit_from_json, read_edits
from tests.refused import refused
from tests.take.helpers import recorded_take
from tests.web.playback.takes import take_of_two, take_with_solves

ALL = (
    PinEdit(id="pin", start_s=0.5, end_s=0.5, joint="left_wrist", place_m=(0.1, 0.2, 1.3), radius_m=0.02),
    DirectionEdit(id="look", start_s=0.2, end_s=0.7, of="head", direction=(0.0, -1.0, 0.0)),
    ContactEdit(id="stands", start_s=0.2, end_s=0.7, joint="left_ankle"),
    ContactEdit(id="holds", start_s=0.2, end_s=0.7, joint="left_hand", touches="right_hip"),
    LeaveOutEdit(id="out", start_s=0.2, end_s=0.7, joints=("left_wrist", "left_hand")),
    ExchangeEdit(id="swap", start_s=0.2, end_s=0.7, note="it saw their back"),
    OffsetEdit(id="raise", start_s=0.2, end_s=0.7, joint="LeftForeArm", rotation_deg=(10.0, 0.0, 0.0)),
    TrimEdit(id="trim", start_s=0.1, end_s=1.5),
    RetimeEdit(id="slow", start_s=0.5, end_s=1.0, factor=2.0, on=False),
)


@pytest.fixture
def take(tmp_path):
    return take_with_solves(tmp_path / "monday" / "walk")


def pin(**values):
    usual = {"id": "", "start_s": 0.5, "end_s": 0.5, "joint": "left_wrist", "place_m": (0.0, 0.0, 1.0)}
    return PinEdit(**usual | values)


def test_every_kind_is_kept_and_read_back(take):
    kept = change_edits(take, ALL)
    assert kept.edits == ALL == read_edits(take).edits
    assert kept.revision == 1
    assert edits_of_solve(take).edits == ALL[:-1]  # one is off
    file = json.loads((take.path / "edits.json").read_text())
    assert (file["format_version"], file["revision"], file["edits"][0]["kind"]) == (1, 1, "pin")


def test_a_take_without_a_file_has_no_edits(take):
    assert read_edits(take).edits == ()
    assert (edits_of_solve(take).edits, edits_of_solve(take).revision) == ((), 0)
    assert not (take.path / "edits.json").exists()


@pytest.mark.parametrize(
    ("edit", "code"),
    [
        (pin(joint="tail"), "edits.one_of"),
        (pin(start_s=0.9), "edits.times"),
        (pin(start_s=math.nan), "edits.number"),
        (pin(place_m=(0.0, math.inf, 0.0)), "edits.number"),
        (pin(start_s=7.0, end_s=8.0), "edits.outside_solves"),
        (pin(ease_s=-1.0), "edits.range"),
        (pin(radius_m=-0.1), "edits.range"),
        (pin(place_m=(0.0, 0.0, 1e6)), "edits.range"),
        (pin(performer="performer_2"), "edits.one_of"),
        (pin(id="a b"), "edits.id"),
        (pin(note="x" * 501), "edits.range"),
        (DirectionEdit(id="", start_s=0, end_s=1, of="head", direction=(0, 0, 0)), "edits.direction"),
        (ContactEdit(id="", start_s=0, end_s=1, joint="head"), "edits.one_of"),
        (ContactEdit(id="", start_s=0, end_s=1, joint="left_hand", touches="left_hand"), "edits.itself"),
        (
            ContactEdit(id="", start_s=0, end_s=1, joint="left_hand", touches="head", other="nobody"),
            "edits.one_of",
        ),
        (LeaveOutEdit(id="", start_s=0, end_s=1), "edits.everything"),
        (LeaveOutEdit(id="", start_s=0, end_s=1, camera="nobody"), "edits.one_of"),
        (OffsetEdit(id="", start_s=0, end_s=1, joint="Tail"), "edits.one_of"),
        (OffsetEdit(id="", start_s=0, end_s=1, joint="LeftHand", move_m=(0, 0, 1)), "edits.move"),
        (RetimeEdit(id="", start_s=0, end_s=1, factor=0.0), "edits.range"),
    ],
)
def test_what_is_not_allowed_is_told_in_one_line(take, edit, code):
    with refused(TakeError, "edits.not_allowed") as told:
        change_edits(take, [edit])
    assert told.value.values["why"].code == code
    assert not (take.path / "edits.json").exists()


def test_pins_that_contradict_each_other_are_told(take):
    change_edits(take, [pin(id="one")])
    change_edits(take, [pin(id="near", place_m=(0.4, 0.0, 1.0))])
    with refused(TakeError, "edits.two_places"):
        change_edits(take, [pin(id="far", place_m=(0.0, 0.6, 1.0))])
    change_edits(take, [pin(id="later", start_s=0.6, end_s=0.7, place_m=(0.0, 0.6, 1.0))])
    change_edits(take, [pin(id="off", place_m=(0.0, 0.6, 1.0), on=False)])


def test_edits_of_one_of_several_performers(tmp_path):
    take = take_of_two(tmp_path / "monday" / "fight")
    assert change_edits(take, [pin(performer="performer_2", start_s=1.0, end_s=1.0)]).edits[0].id == "e1"


@pytest.mark.parametrize(
    "value",
    [
        {"kind": "wish", "id": "a", "start_s": 0, "end_s": 1},
        {"kind": "pin", "id": "a", "start_s": 0, "end_s": 1, "joint": "head"},
        {"kind": "pin", "id": "a", "start_s": "now", "end_s": 1, "joint": "head", "place_m": [0, 0, 1]},
        {"kind": "trim", "id": "a", "start_s": 0, "end_s": 1, "colour": "red"},
        [1, 2],
    ],
)
def test_what_is_no_edit_is_told(value):
    with refused(TakeError, "edits.not_an_edit"):
        edit_from_json(value)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ('{"format_version": 2, "edits": []}', "file.version"),
        ('{"format_version": 1, "edits": [{"kind": "wish"}]}', "edits.damaged"),
        ('{"format_version": 1, "edi', "edits.damaged"),
        ("[]", "edits.damaged"),
    ],
)
def test_a_file_that_cannot_be_read_stays_and_the_take_can_be_solved(take, text, code):
    file = take.path / "edits.json"
    file.write_text(text)
    with refused(FormatError, code):
        change_edits(take, [pin()])
    assert file.read_text() == text
    used = edits_of_solve(take)
    assert (used.edits, used.revision, used.says.code) == ((), None, "edits.not_used")


def calibrate(take, T):
    take.add_calibration(Calibration("left", {"left": CameraCalibration(T)}, None), use=True)


def test_a_take_that_is_calibrated_anew_carries_its_edits(tmp_path):
    take = recorded_take(tmp_path / "monday" / "walk", ["left"], 3)
    calibrate(take, np.eye(4))
    change_edits(take, [ALL[0], ALL[1]])
    turned = np.array(
        [[0.0, -1.0, 0.0, 0.5], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.25], [0.0, 0.0, 0.0, 1.0]]
    )
    calibrate(take, turned)
    used = edits_of_solve(take)
    assert used.says.code == "edits.carried"
    assert used.edits[0].place_m == pytest.approx((0.3, 0.1, 1.55))
    assert used.edits[1].direction == pytest.approx((1.0, 0.0, 0.0))
    assert read_edits(take).calibration == 1  # only a change writes
    kept = change_edits(take, [ALL[2]])
    assert (kept.calibration, kept.edits[0]) == (2, used.edits[0])
    assert edits_of_solve(take).says == ""


def test_edits_that_cannot_be_carried_are_left_out(tmp_path):
    take = recorded_take(tmp_path / "monday" / "walk", ["left"], 3)
    calibrate(take, np.eye(4))
    change_edits(take, [ALL[0]])
    take.add_calibration(Calibration("right", {"right": CameraCalibration(np.eye(4))}, None), use=True)
    used = edits_of_solve(take)
    assert (used.edits, used.says.values["why"].code) == ((), "edits.other_cameras")
    with refused(TakeError, "edits.other_cameras"):
        change_edits(take, remove=["pin"])
