"""Frames for a calibration are gathered, and how well the cameras agree is estimated meanwhile."""

from pathlib import Path

from studio.live.calibration.calibrator import Calibrator, Outcome
from tests.api.camera import wait_until
from tests.engine.calibration.synthetic import RIGS, record

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
    wait_until(lambda: calibrator.attempt.estimates, "an estimate")
    told = calibrator.status(4 * SECOND).estimates
    assert told.keys() == {"camera_1"}
    assert 5 < told["camera_1"].residual_median_mm < 100
