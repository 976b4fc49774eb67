"""Edits in the solve of a take, from its frames to its figures."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from studio.engine.edits.edit import ContactEdit, DirectionEdit, LeaveOutEdit, OffsetEdit, PinEdit, TrimEdit
from studio.engine.metrics.cleanup.solve import solve_cleanup
from studio.engine.model.calibration import Calibration
from studio.engine.model.frames import CameraFrame
from studio.engine.model.joints import OUTPUT_INDEX
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.trace import Trace
from studio.offline import preview, replay
from studio.offline.edits.around import solve_around
from studio.offline.edits.first_look import read_ahead
from studio.offline.edits.mend import mend
from studio.offline.edits.offers import offers
from studio.offline.replay import solve_take
from studio.offline.tracking import calibrate_take
from studio.take.edits.change import undo_edits
from studio.take.edits.kept import read_edits
from studio.take.folder.take import Take
from studio.take.importers import import_recording
from studio.take.raw.frames import camera_frames
from tests.simulator.pin_faults import Fault, faulty

WRIST = OUTPUT_INDEX["RightHand"]
BEGIN_S, END_S = 38.0, 39.0
LAST_S = 44.5
"""End of the shortened take; no edit is later."""


@pytest.fixture(scope="module")
def take(tmp_path_factory, test_data) -> Take:
    source = test_data / "noisy_joints" / "punches_2_cameras"
    if not source.is_dir():
        pytest.skip(f"no {source}")
    folder = tmp_path_factory.mktemp("edits")
    for camera in source.glob("camera_*"):
        header, *rows = (camera / "joints.csv").read_text().splitlines()
        kept = [header, *(row for row in rows if float(row.partition(",")[0]) < LAST_S)]
        (folder / "short" / camera.name).mkdir(parents=True)
        (folder / "short" / camera.name / "joints.csv").write_text("\n".join(kept))
    shutil.copyfile(source / "recording.json", folder / "short" / "recording.json")
    take = import_recording(folder / "short", folder / "take")
    take.add_calibration(calibrate_take(take), use=True)
    return Take.open(take.path)


def solved(take: Take, preset: str = "studio", edits=()) -> tuple[Poses, dict]:
    folder = solve_take(take, parse_settings(preset), name="test", edits=edits, to_disk=False)
    return Poses.load(folder / "poses.npz"), json.loads((folder / "metrics.json").read_text())


@pytest.fixture(scope="module")
def plain(take) -> tuple[Poses, Trace]:
    """The solve without edits, and what it kept for solves with edits."""
    folder = solve_take(take, parse_settings("studio"), name="plain", to_disk=False)
    return Poses.load(folder / "poses.npz"), Trace.load(folder / "trace.npz")


@pytest.fixture(scope="module")
def clean(plain) -> Poses:
    return plain[0]


def with_lost_wrist(take: Take, path: Path) -> dict[str, list[CameraFrame]]:
    """The take's frames with a wrist that all cameras take for the spine, for a second."""
    calibration: Calibration = take.calibration()
    fault = Fault("lost", BEGIN_S, END_S, "right_wrist")
    frames = camera_frames(path)
    return {name: [*mine] for name, mine in faulty(frames, calibration, fault).items()}


def test_one_pin_mends_a_second_and_leaves_the_rest(take, clean, monkeypatch):
    frames = with_lost_wrist(take, take.raw_path)
    monkeypatch.setattr(replay, "camera_frames", lambda path: frames)
    before, figures = solved(take)
    assert "edits" not in figures
    inside = (clean.time_s >= BEGIN_S) & (clean.time_s <= END_S)
    off = np.linalg.norm((before.positions_m - clean.positions_m)[:, WRIST], axis=1)
    at = int(np.argmax(off * inside))
    x, y, z = (clean.positions_m[at, WRIST] + [0.01, -0.01, 0.01]).tolist()
    at_s = float(clean.time_s[at])
    pin = PinEdit(id="a", joint="right_wrist", place_m=(x, y, z), start_s=at_s, end_s=at_s)
    after, figures = solved(take, edits=[pin])
    assert figures["edits"]["a"]["honoured"] and figures["edits"]["a"]["missed_mm"] < 10.0
    (mended,) = figures["edits"]["a"]["mended"]
    assert "right_wrist" in mended["joints"] and mended["cameras"] == sorted(frames)
    assert (mended["start_s"], mended["end_s"]) == pytest.approx((BEGIN_S, END_S), abs=0.15)
    assert mended["guessed"]  # only the pin shows where a lost wrist was
    left = np.linalg.norm((after.positions_m - clean.positions_m)[:, WRIST], axis=1)
    assert left[inside].mean() < off[inside].mean() / 3.0
    outside = (clean.time_s < BEGIN_S - 0.5) | (clean.time_s > END_S + 1.0)
    assert np.array_equal(after.positions_m[outside], before.positions_m[outside])


def test_every_edit_is_told_of_and_the_take_stays_solvable(take, clean):
    place = (3.0, 3.0, 3.0)
    at = {"start_s": 40.0, "end_s": 40.0}
    edits = [
        PinEdit(id="far", joint="left_wrist", place_m=place, **at),
        PinEdit(id="tail", joint="tail", place_m=place, **at),
        PinEdit(id="late", joint="left_wrist", place_m=place, start_s=999.0, end_s=999.0),
        PinEdit(id="one", joint="left_knee", place_m=(0.0, 0.0, 0.5), **at),
        PinEdit(id="other", joint="left_knee", place_m=(0.0, 1.0, 0.5), **at),
        PinEdit(id="off", joint="left_knee", place_m=place, on=False, **at),
        LeaveOutEdit(id="camera", camera="camera_9", start_s=40.0, end_s=41.0),
        DirectionEdit(
            id="palm", of="left_palm", direction=(0.0, -1.0, 0.0), radius_deg=60.0, start_s=42.0, end_s=42.2
        ),
        OffsetEdit(id="up", joint="Hips", move_m=(0.0, 0.0, 0.1), start_s=43.0, end_s=43.2),
        TrimEdit(id="trim", start_s=36.0, end_s=44.0),
    ]
    poses, figures = solved(take, edits=edits)
    told = figures["edits"]
    assert set(told) == {edit.id for edit in edits if edit.on}
    honoured = {key for key, one in told.items() if one["honoured"]}
    assert honoured == {"palm", "up", "trim"}
    assert all(one["line"] for key, one in told.items() if key not in honoured)
    assert told["far"]["missed_mm"] > 1000.0
    assert poses.time_s[0] >= 36.0 and poses.time_s[-1] <= 44.0
    beside = at_times_of(clean, poses.time_s)
    hips = np.linalg.norm(poses.positions_m[:, 0] - beside[:, 0], axis=1)
    assert hips[np.abs(poses.time_s - 40.0) < 0.5].max() < 0.15
    arm = poses.positions_m[int(np.abs(poses.time_s - 40.0).argmin())]
    stretched = arm[OUTPUT_INDEX["LeftHand"]] - arm[OUTPUT_INDEX["LeftArm"]]
    assert np.linalg.norm(stretched) > 0.4  # the limb approaches it
    raised = np.abs(poses.time_s - 43.1) < 0.05
    assert (poses.positions_m - beside)[raised, 0, 2] == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize("preset", ["studio", "finish"])
def test_a_hand_holds_the_hip_and_the_rest_of_the_take_stays(take, clean, preset):
    edit = ContactEdit(id="a", joint="left_hand", touches="left_hip", start_s=40.0, end_s=41.0)
    poses, figures = solved(take, preset, [edit])
    inside = (poses.time_s >= 40.0) & (poses.time_s <= 41.0)
    hand, hip = (OUTPUT_INDEX[name] for name in ("LeftHandMiddle1", "LeftUpLeg"))
    apart = np.linalg.norm((poses.positions_m[:, hand] - poses.positions_m[:, hip])[inside], axis=1)
    assert figures["edits"]["a"]["honoured"] and apart.max() < 0.16  # as thick as both are, and 4 cm
    moved = np.linalg.norm(
        poses.positions_m[inside][:, 0] - at_times_of(clean, poses.time_s[inside])[:, 0], axis=1
    )
    assert moved.max() < 0.1


def at_times_of(poses: Poses, time_s: np.ndarray) -> np.ndarray:
    """Positions in the frames at these times [m]."""
    return poses.positions_m[np.searchsorted(poses.time_s, time_s - 1e-4)]


@pytest.mark.parametrize("preset", ["studio", "finish"])
def test_the_surroundings_of_an_instant_are_solved_into_the_whole_solve(take, clean, preset):
    at = int(np.searchsorted(clean.time_s, 40.0))
    x, y, z = (clean.positions_m[at, WRIST] + [0.0, 0.0, 0.1]).tolist()
    at_s = float(clean.time_s[at])
    pin = PinEdit(id="a", joint="right_wrist", place_m=(x, y, z), start_s=at_s, end_s=at_s)
    found = solve_around(take, parse_settings(preset), [pin], at_s, stored=clean)
    first = int(np.searchsorted(clean.time_s, found.time_s[0] - 1e-4))
    beside = clean.positions_m[first : first + found.frame_count]
    np.testing.assert_allclose(found.time_s, clean.time_s[first : first + found.frame_count])
    np.testing.assert_allclose(found.positions_m[[0, -1]], beside[[0, -1]], atol=1e-6)
    middle = int(np.abs(found.time_s - at_s).argmin())
    assert np.linalg.norm(found.positions_m[middle, WRIST] - (x, y, z)) < 0.03


@pytest.mark.parametrize("first", ["look", "read ahead"])
def test_a_look_reads_nothing_that_was_read_before(take, clean, monkeypatch, first):
    at_s = float(clean.time_s[len(clean.time_s) // 2])
    x, y, z = (clean.positions_m[len(clean.time_s) // 2, WRIST] + [0.0, 0.0, 0.1]).tolist()
    pin = PinEdit(id="a", joint="right_wrist", place_m=(x, y, z), start_s=at_s, end_s=at_s)

    def look() -> Poses:
        return solve_around(take, parse_settings("finish"), [pin], at_s, stored=clean)

    before = look()
    if first == "read ahead":
        preview._recent.cache_clear()
        read_ahead(take, parse_settings("finish"))
    for name in ("preview.camera_frames", "preview.feet_seen", "tracking.indexed_topics"):
        monkeypatch.setattr(f"studio.offline.{name}", None)
    np.testing.assert_array_equal(look().positions_m, before.positions_m)


def test_each_event_has_a_cause_and_an_edit(take, plain):
    found = offers(*plain, start_s=take.meta["calibration_s"])
    assert found and all(one.why and one.edits for one in found)
    for one in found:
        assert one.camera in (None, "camera_0", "camera_1") and one.off_mm >= 0.0
        assert all(edit.start_s <= one.event["peak_s"] <= edit.end_s + 0.02 for edit in one.edits)


@pytest.mark.long
def test_a_take_mends_itself_and_one_undo_takes_it_back(take):
    settings, start_s = parse_settings("studio"), take.meta["calibration_s"]

    def events(name: str) -> list:
        poses = Poses.load(solve_take(take, settings, name=name, to_disk=False) / "poses.npz")
        return solve_cleanup(poses, start_s=start_s)["cleanup_events"]

    before = events("before")
    mended = mend(take, settings)
    assert (mended.before, mended.after) == (len(before), len(events("mended")))
    assert mended.after <= mended.before and bool(mended.edits) == (mended.after < mended.before)
    assert len(read_edits(take).edits) == len(mended.edits)
    if mended.edits:
        assert not undo_edits(take).edits
