"""Depth images of several performers: who is in them, and who hides whom."""

from dataclasses import replace

import numpy as np
import pytest

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.base.errors import SettingsError
from studio.engine.model.joints import INDEX
from studio.simulator.crowd.depth import depth_stage
from studio.simulator.crowd.meeting import Meeting
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.recording import truth_csv
from studio.simulator.sensor.sensors import find_sensor
from tests.refused import refused


def meeting(*places, enters_s=0.5) -> Meeting:
    """One performer for each of `places` holds a T-pose there; all but the first come in later."""
    demo = demo_motion()
    t_pose = replace(demo, positions_m=demo.positions_m[:120], hands_open=np.ones((120, 2)))
    motions = tuple(replace(t_pose, positions_m=t_pose.positions_m + np.array([*p, 0.0])) for p in places)
    return Meeting(motions, (0.0, *[enters_s] * (len(places) - 1)), 0.0)


def test_one_is_before_the_other_who_comes_in_later():
    rig, sensor = standard_rig(1), find_sensor("ideal")
    behind = rig[0].T_stage_camera[:2, 2]
    behind = 0.8 * behind / np.linalg.norm(behind)
    stage = depth_stage(meeting((0.0, 0.0), behind), rig, sensor, "tuning-average")
    alone, both = (stage.camera(0).image(time_s).astype(float) for time_s in (0.4, 0.6))
    changed = np.abs(both - alone) > 300
    assert changed.sum() > 100  # the other one's arms and head stand out behind
    near = (alone > 0) & (alone < 1e3 * np.linalg.norm(rig[0].T_stage_camera[:3, 3]) + 200)
    assert not (changed & near).any()  # pixels of the first performer do not change
    (_, other), first = stage.others[0], stage.performance
    rows = [np.genfromtxt(truth_csv(done).splitlines(), delimiter=",", names=True) for done in (first, other)]
    assert rows[0]["time_s"][0] == 0.0 and rows[1]["time_s"][0] == pytest.approx(0.5)
    heights = [rows_of["head_z"][0] for rows_of in rows]
    assert heights[0] != heights[1]  # each has a body of their own
    assert first.motion.positions_m[0, INDEX["hips"], 1] < other.motion.positions_m[0, INDEX["hips"], 1]


def test_there_is_a_body_for_each():
    rig, sensor = standard_rig(1), find_sensor("ideal")
    with refused(SettingsError, "simulator.few_bodies", count=40):
        depth_stage(meeting(*[(0.0, 0.0)] * 40), rig, sensor, "tuning-average")
