"""When cameras disagree in a take, and how a solve reports and handles it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from studio.engine.calibration.calibrate import calibrate
from studio.engine.calibration.quality.agreement import disagreements, without_named
from studio.engine.model.settings.settings import PRESETS
from studio.offline.replay import solve_take
from studio.offline.tracking import calibrate_take, keep_calibration
from studio.take.folder.take import Take
from studio.take.importers import import_recording
from studio.web.playback.clip import Clip
from studio.web.playback.curves import curves
from tests.engine.calibration.synthetic import RIGS, Options, record
from tests.engine.calibration.test_holding import bumped
from tests.engine.calibration.test_recordings import STUDY_2


@pytest.mark.parametrize(
    ("rig", "metres"), [(2, 0.08), (3, 0.08), pytest.param(3, 0.2, marks=pytest.mark.long)]
)
def test_a_move_is_found_to_a_fraction_of_a_second(rig, metres):
    frames, _ = record(110 + rig, RIGS[rig], Options(duration_s=34))
    calibration = calibrate(frames)
    since_s = frames["camera_0"][0].device_time_ns * 1e-9
    moved = bumped(frames, 22.0, metres, 2.0)
    found = disagreements(calibration, moved)
    told = ["camera_1"] if rig == 3 else ["camera_0", "camera_1"]
    assert [name for name, spans in found.items() if spans] == told
    (span,) = found["camera_1"]
    assert abs(span.from_s - since_s - 22.0) < 0.3
    assert span.to_s is None
    assert span.named == (rig == 3)
    kept = without_named(calibration, moved, found)
    clock = calibration.cameras["camera_1"].clock
    last_s = clock.stage_ns(kept["camera_1"][-1].device_time_ns) * 1e-9
    assert (last_s < span.from_s) == (rig == 3)
    assert kept["camera_0"] == moved["camera_0"]
    assert not any(disagreements(calibration, frames).values())


def test_a_solve_says_when_real_kinects_disagreed(test_data: Path, tmp_path: Path):
    path = test_data / "kinect2_pairs" / STUDY_2
    if not path.is_file():
        pytest.skip(f"no {path}")
    take = import_recording(path, tmp_path / "take")
    keep_calibration(take, calibrate_take(take))
    folder = solve_take(take, replace(PRESETS["raw"], output_hz=10), name="raw")
    metrics = json.loads((folder / "metrics.json").read_text())
    assert metrics["agreement"].startswith("camera_0 and camera_1 disagreed from ")
    (span,) = metrics["disagrees"]["camera_1"]
    assert span["to_s"] is None
    assert not span["named"]
    clip = Clip.load(Take.open(take.path), "raw")
    ((first, last, mm),) = curves(clip, "Hips").disagrees["camera_1"]
    assert 99.0 < clip.poses.time_s[first] - clip.poses.time_s[0] < 100.5
    assert last == clip.poses.frame_count - 1
    assert mm > 60
