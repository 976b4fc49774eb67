"""Poses between the steps of the stage."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from studio.streams.between import MOST_S, PosesBetween

STEP_S = 1.0 / 30.0


def step(x_m: float, turn_rad: float, time_s: float) -> Any:
    half = 0.5 * turn_rad
    frame_set = SimpleNamespace(stage_time_ns=round(time_s * 1e9))
    return cast(
        "Any",
        SimpleNamespace(
            positions_m=np.full((52, 3), x_m),
            rotations_wxyz=np.tile([np.cos(half), np.sin(half), 0.0, 0.0], (52, 1)),
            root_height_m=None,
            frame_set=frame_set,
        ),
    )


def test_a_pose_goes_evenly_from_step_to_step_at_a_higher_rate():
    poses, places, times = PosesBetween(), [], []
    for k in range(31):
        now_s = 0.01 * k + 1e-6
        if k % 10 == 0:
            count = k // 10
            poses.add(step(0.03 * count, 0.1 * count, 0.1 * count), now_s)
        pose = poses.at(now_s)
        places.append(pose.positions_m[0, 0])
        times.append(pose.time_s)
        assert np.allclose(np.linalg.norm(pose.rotations_wxyz, axis=1), 1.0)
    assert np.allclose(np.diff(places)[10:], 0.003, atol=1e-6), "each at the same pace"
    assert np.allclose(np.diff(times)[10:], 0.01, atol=1e-6)


def test_a_pose_waits_at_the_newest_step_and_is_there_soon_after_a_gap():
    poses = PosesBetween()
    poses.add(step(0.0, 0.0, 0.0), 0.0)
    poses.add(step(1.0, 0.0, STEP_S), 1.0)
    assert poses.at(1.0 + STEP_S).positions_m[0, 0] == 1.0
    assert poses.at(9.0).positions_m[0, 0] == 1.0
    poses.add(step(2.0, 0.0, 8.0), 9.0)
    assert np.isclose(poses.at(9.0 + 0.5 * MOST_S).positions_m[0, 0], 1.5)
    poses.add(step(5.0, 0.0, 3.0), 20.0)
    assert poses.at(20.0).positions_m[0, 0] == 5.0, "a clock that jumps back begins anew"
