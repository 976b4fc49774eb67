"""Frames for a calibration are gathered, and how well the cameras agree is estimated meanwhile."""

from pathlib import Path

from studio.live.calibration.calibrator import Calibrator, Outcome
from tests.api.camera import wait_until
from tests.engine.calibration.synthetic import RIGS, record
from tests.engine.calibration.views.synthetic import HEIGHT_M, camera_at, view_of
from tests.engine.calibration.views.test_pictures import frames_of

SECOND = 1_000_000_000


def test_the_agreement_is_estimated_while_a_walk_goes_on(tmp_path: Path) -> None:
    outcomes: list[Outcome] = []
    calibrator = Calibrator(tmp_path, outcomes.append)
    calibrator.start(30.0, 0, {})
    frames, _ = record(0, RIGS[2])
    for mine in frames.values():
        for frame in mine[:300]:
            calibrator.add(frame)
    calibrator.update(SECOND, "camera_0", lambda frame: frame)
    assert calibrator.status(SECOND).estimates == {}  # not yet
    calibrator.update(3 * SECOND, "camera_0", lambda frame: frame)
    wait_until(lambda: bool(calibrator.attempt.estimates), "an estimate")
    told = calibrator.status(4 * SECOND).estimates
    assert told.keys() == {"camera_1"}
    assert 5 < told["camera_1"].residual_median_mm < 100


def test_cameras_without_depth_are_adjusted_while_a_walk_goes_on(tmp_path: Path) -> None:
    calibrator = Calibrator(tmp_path, [].append)
    calibrator.start(60.0, 0, {}, HEIGHT_M)
    views = [view_of("left", camera_at(0.0), seed=1), view_of("right", camera_at(85.0), seed=2, ahead_s=0.2)]
    seen = {view.name: frames_of(view, k * SECOND) for k, view in enumerate(views)}
    for mine in seen.values():
        for frame in mine[:100]:
            calibrator.add(frame)
    calibrator.update(3 * SECOND, "left", lambda frame: frame)
    for mine in seen.values():
        for frame in mine[100:]:
            calibrator.add(frame)
    wait_until(lambda: not calibrator.estimating, "the first look")
    assert calibrator.status(4 * SECOND).estimates == {}  # too little was seen
    calibrator.update(6 * SECOND, "left", lambda frame: frame)
    wait_until(lambda: bool(calibrator.attempt.estimates), "an estimate")
    told = calibrator.status(7 * SECOND).estimates
    assert told.keys() == {"left", "right"}
    for one in told.values():
        assert one.residual_median_mm is not None and 1 < one.residual_median_mm < 30
        assert one.residual_median_px is not None and 0.3 < one.residual_median_px < 10
