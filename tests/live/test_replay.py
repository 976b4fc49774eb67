"""Replay of takes that lack something: one clear error, and nothing half-written."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.base.errors import CalibrationError, TakeError
from studio.engine.calibration.calibrate import with_performer
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import preset
from studio.offline import preview
from studio.offline.preview import solve_part
from studio.offline.replay import solve_take
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter
from studio.wire import encode
from tests.live.performer import calibration, frame, hello
from tests.refused import refused

CALIBRATION_S = 1.0


@pytest.fixture
def take(tmp_path):
    """A take as an import makes it: two cameras, 2 s, the first of them for calibration, no live log."""
    take = Take.create(tmp_path / "t", session="s", name="t", source="import", calibration_s=CALIBRATION_S)
    with RawWriter(take.raw_path) as writer:
        for index in range(2):
            writer.add_camera(hello(f"camera_{index}"))
        for k in range(60):
            for index in range(2):
                message = frame(index, k, k * 33_333_333, k / 30)
                writer.frame(
                    f"camera_{index}",
                    encode(message),
                    arrival_ns=message.device_time_ns,
                    device_time_ns=message.device_time_ns,
                    sequence=k,
                )
    return take


def nothing_written(take):
    return list((take.path / "solves").iterdir()) == []


def test_a_take_without_calibration(take):
    with refused(CalibrationError, "take.not_calibrated"):
        solve_take(take, preset("studio"), name="studio")
    assert nothing_written(take)


def test_a_take_without_live_log(take):
    take.add_calibration(calibration(["camera_0", "camera_1"]), use=True)
    with refused(TakeError, "take.no_live_log"):
        solve_take(take, preset("studio"), name="again", as_live=True)
    assert nothing_written(take)


def test_a_name_that_leads_elsewhere(take):
    with refused(TakeError, "name.not_allowed"):
        solve_take(take, preset("studio"), name="../up")


def test_the_calibration_part_is_left_out_and_a_solve_is_replaced_whole(take):
    take.add_calibration(calibration(["camera_0", "camera_1"]), use=True)
    shares: list[float] = []
    folder = solve_take(take, preset("studio"), name="studio", progress=shares.append)
    poses = Poses.load(folder / "poses.npz")
    assert poses.time_s[0] >= CALIBRATION_S and poses.frame_count > 50 and shares[-1] == 1.0
    (folder / "old.txt").write_text("of the solve before")
    solve_take(take, preset("raw"), name="studio")
    assert sorted(file.name for file in folder.iterdir()) == [
        "metrics.json",
        "poses.npz",
        "settings.json",
        "trace.npz",
    ]
    assert [file.name for file in folder.parent.iterdir()] == ["studio"]


def test_a_preview_is_nearly_the_whole_solve_there_and_keeps_nothing(take):
    take.add_calibration(calibration(["camera_0", "camera_1"]), use=True)
    part = solve_part(take, preset("finish"), 1.5, 1.8)  # finishing needs the whole take: it is left out
    assert nothing_written(take) and 1.5 <= part.time_s[0] < part.time_s[-1] <= 1.8
    whole = Poses.load(solve_take(take, preset("studio"), name="studio") / "poses.npz")
    first = int(np.argmin(np.abs(whole.time_s - part.time_s[0])))
    same = whole.positions_m[first : first + part.frame_count]
    assert np.linalg.norm(same - part.positions_m, axis=2).max() < 0.03
    with refused(TakeError, "take.nobody_seen"):
        solve_part(take, preset("studio"), 50.0, 60.0)


def test_what_all_frames_show_of_the_performer_is_found_once_for_all_previews(take, monkeypatch):
    known = calibration(["camera_0", "camera_1"])
    take.add_calibration(replace(known, performer=replace(known.performer, soles_measured=False)), use=True)
    measured = []
    monkeypatch.setattr(preview, "with_performer", lambda *a: measured.append(1) or with_performer(*a))
    first, again = (solve_part(take, preset("studio"), 1.5, 1.8) for _ in range(2))
    assert len(measured) == 1 and first.positions_m.tobytes() == again.positions_m.tobytes()
    take.add_calibration(replace(known, performer=None), use=True)
    solve_part(take, preset("studio"), 1.5, 1.8)
    assert len(measured) == 2, "another calibration is in use"
