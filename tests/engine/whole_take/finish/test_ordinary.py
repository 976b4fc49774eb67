"""Difficult moments of recorded motions, seen by four ordinary cameras and finished: small steps, bent trunks."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from studio.engine.model.joints import INDEX
from studio.simulator.landmarks.timing import PictureTiming
from studio.simulator.motion import stage_motion
from tests.simulator.phones import MEASURED, errors_mm, seen_by


def finished_mm(path: Path, begin_s: float, end_s: float, joints: tuple[str, ...]) -> NDArray[np.float64]:
    """Errors of some joints between two times of a motion, over three seeds, with true cameras and body."""
    if not path.is_file():
        pytest.skip(f"no {path}")
    whole, _ = stage_motion(path, calibration=False)
    begin, end = (round(time_s / whole.frame_s) for time_s in (begin_s, end_s))
    motion = replace(whole, positions_m=whole.positions_m[begin:end])
    errors = [errors_mm(motion, seen_by(motion, 4, seed, PictureTiming()), "finish") for seed in (1, 2, 3)]
    return np.concatenate(errors)[:, [MEASURED.index(INDEX[name]) for name in joints]]


def test_a_foot_that_shuffles_by_six_centimetres_is_at_both_places(test_data: Path) -> None:
    ankle = finished_mm(test_data / "mocap" / "02_04.bvh", 2.6, 4.0, ("left_ankle",))
    assert ankle.mean() < 28.0  # 34 where both places count as one


def test_a_dancer_who_bends_forward_has_her_hip_joints_in_place(test_data: Path) -> None:
    hips = finished_mm(test_data / "mocap" / "05_06.bvh", 0.8, 1.9, ("left_hip", "right_hip"))
    assert hips.mean() < 49.5  # 51 where hips on a straight trunk count as much as other joints
