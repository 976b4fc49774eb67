"""The verdict on cameras whose poses were refined on the tracked body."""

import numpy as np
import pytest

from studio.engine.base.sentences import Said, say
from studio.engine.model.calibration import CameraCalibration
from studio.engine.seeing.cameras.camera_poses import _judged

FEW, MIRRORED = say("verdict.few_pairs", "few pairs"), say("verdict.mirrored", "mirrored")


@pytest.mark.parametrize(
    ("residual_m", "verdict", "codes"),
    [
        (0.010, "good", []),
        (0.020, "usable", []),
        (0.042, "refused", ["verdict.off_body"]),
        (None, "refused", ["verdict.few_pairs"]),
    ],
)
def test_too_little_spread_is_judged_again_by_the_body(residual_m, verdict, codes):
    judged = _judged(CameraCalibration(np.eye(4), verdict="refused", reasons=(FEW,)), residual_m)
    assert judged.verdict == verdict
    assert [reason.code for reason in judged.reasons if isinstance(reason, Said)] == codes


def test_other_reasons_stay():
    camera = CameraCalibration(np.eye(4), verdict="refused", reasons=(FEW, MIRRORED))
    assert _judged(camera, 0.01) is camera


def test_the_distance_is_told_in_millimetres():
    (reason,) = _judged(CameraCalibration(np.eye(4)), 0.0424).reasons
    assert isinstance(reason, Said) and reason.values == {"mm": "42"}
