import csv

import numpy as np
import pytest

from studio.engine.base.errors import FormatError, SettingsError, TakeError
from studio.engine.model.joints import CANONICAL, INDEX
from studio.simulator.simulate import simulate_take
from studio.take.folder.take import Take
from studio.take.raw.frames import camera_frames
from tests.engine.animation.motion.bvh_files import MIXAMO, bvh_text, channel_count
from tests.refused import refused


@pytest.fixture
def motion(tmp_path):
    """Two seconds of a body that stands still, 30 cm from the origin, at 30 Hz."""
    frame = [30.0, 95.0, 0.0] + [0.0] * (channel_count(MIXAMO) - 3)
    path = tmp_path / "motion.bvh"
    path.write_text(bvh_text(MIXAMO, [frame] * 61, frame_s=1 / 30))
    return path


def read_truth(path):
    with open(path, newline="") as file:
        header, *rows = csv.reader(file)
    assert header == ["time_s", *(f"{name}_{axis}" for name in CANONICAL for axis in "xyz")]
    table = np.array(rows, dtype=float)
    return table[:, 0], table[:, 1:].reshape(len(table), -1, 3)


def test_a_take_and_its_truth(tmp_path, motion):
    out = tmp_path / "take"
    shares = []
    assert simulate_take(motion, out, cameras=2, seed=1, unit_m=0.01, progress=shares.append) == out
    assert shares[-1] == 1.0
    take = Take.open(out)
    assert take.meta["calibration_s"] == pytest.approx(33.0, abs=0.02)
    assert take.meta["source"] == "simulate" and take.meta["recording"] == "done"
    time_s, truth = read_truth(tmp_path / "take.truth.csv")
    assert 1 / np.median(np.diff(time_s)) >= 60
    still = truth[time_s > take.meta["calibration_s"] + 0.1]
    np.testing.assert_allclose(still[:, INDEX["hips"], :2], 0, atol=2e-4)  # centred
    assert 0 < still[..., 2].min() < 0.03  # on the floor
    frames = camera_frames(take.raw_path)
    assert list(frames) == ["camera_0", "camera_1"]
    for camera in frames.values():
        assert len(camera) == pytest.approx(35 * 30, abs=10)
        assert (np.diff([frame.device_time_ns for frame in camera]) > 0).all()


def test_the_reference_camera_has_the_clock_of_the_truth(tmp_path, motion):
    simulate_take(motion, tmp_path / "take", cameras=2, seed=1, unit_m=0.01)
    time_s, truth = read_truth(tmp_path / "take.truth.csv")
    (reference, other) = camera_frames(tmp_path / "take" / "raw.mcap").values()
    assert reference[0].device_time_ns == pytest.approx(0.22e9, abs=0.03e9)
    assert abs(other[0].device_time_ns - reference[0].device_time_ns) > 5e6
    # the height of the hips over the walk, seen by the level reference camera, follows the truth at its stamps
    hips = np.array([frame.positions[0, 1] for frame in reference])
    stamps = np.array([frame.device_time_ns for frame in reference]) * 1e-9
    true = 1.0 - np.interp(stamps, time_s, truth[:, 0, 2])
    use = np.isfinite(hips) & (np.abs(hips - true) < 0.1)
    assert use.mean() > 0.9 and np.abs(np.median((hips - true)[use])) < 0.03


def test_the_seed_decides_the_frames(tmp_path, motion):
    def first(name, seed):
        simulate_take(motion, tmp_path / name, seed=seed, unit_m=0.01, calibration=False)
        return camera_frames(tmp_path / name / "raw.mcap")["camera_0"]

    a, b, c = first("a", 1), first("b", 1), first("c", 2)
    assert [f.device_time_ns for f in a] == [f.device_time_ns for f in b]
    np.testing.assert_array_equal([f.positions for f in a], [f.positions for f in b])
    assert [f.device_time_ns for f in a] != [f.device_time_ns for f in c]


def test_without_calibration_and_without_a_unit(tmp_path, motion):
    simulate_take(motion, tmp_path / "take", calibration=False)
    assert Take.open(tmp_path / "take").meta["calibration_s"] is None
    time_s, truth = read_truth(tmp_path / "take.truth.csv")
    assert time_s[-1] == pytest.approx(59 / 30, abs=0.01)
    assert 1.4 < truth[0, INDEX["head"], 2] < 1.8


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"tracker": "depth", "performer": "nobody"}, SettingsError),
        ({"tracker": "magic"}, SettingsError),
        ({"sensor": "eyes"}, SettingsError),
        ({"seed": -1}, SettingsError),
        ({"cameras": 9}, FormatError),
        ({"rig": "none.json"}, FormatError),
        ({"unit_m": 0.0}, FormatError),
    ],
)
def test_wrong_options_leave_nothing_behind(tmp_path, motion, options, error):
    with pytest.raises(error):
        simulate_take(motion, tmp_path / "out" / "take", **options)
    assert [file.name for file in tmp_path.iterdir()] == ["motion.bvh"]


def test_a_failure_half_way_leaves_nothing_behind(tmp_path, motion):
    def stop(share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate_take(motion, tmp_path / "out" / "take", unit_m=0.01, progress=stop)
    assert [file.name for file in tmp_path.iterdir()] == ["motion.bvh"]


def test_a_cut_motion_leaves_nothing_behind(tmp_path, motion):
    motion.write_text(motion.read_text()[:-40])
    with refused(FormatError, "bvh.line"):
        simulate_take(motion, tmp_path / "take")
    assert [file.name for file in tmp_path.iterdir()] == ["motion.bvh"]


def test_nothing_is_overwritten(tmp_path, motion):
    (tmp_path / "take.truth.csv").write_text("mine")
    with refused(TakeError, "simulator.truth_exists"):
        simulate_take(motion, tmp_path / "take", unit_m=0.01)
    assert (tmp_path / "take.truth.csv").read_text() == "mine"
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "file").write_text("mine")
    with refused(TakeError, "take.not_empty"):
        simulate_take(motion, tmp_path / "other", unit_m=0.01)
    assert not (tmp_path / "other.truth.csv").exists()


def test_the_embedded_performer_can_be_simulated(tmp_path):
    simulate_take("demo", tmp_path / "take", cameras=2, calibration=False)
    assert set(camera_frames(tmp_path / "take" / "raw.mcap")) == {"camera_0", "camera_1"}
    assert (tmp_path / "take.truth.csv").is_file()
