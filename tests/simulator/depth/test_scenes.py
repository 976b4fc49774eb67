"""The hard motions do what their names say, and the room is as large as they need."""

import numpy as np
import pytest

from studio.engine.model.joints import INDEX
from studio.simulator.body.performers import DEFAULT, PERFORMERS
from studio.simulator.performer.motion import perform
from studio.simulator.performer.scenes import SCENES, arms_crossed, crouch, leaves_and_returns
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_begins_in_the_t_pose(name):
    motion = SCENES[name]()
    wrists = motion.positions_m[: motion.frame_count // 50, [INDEX["left_wrist"], INDEX["right_wrist"]]]
    assert (np.abs(wrists[..., 0]) > 0.6).all()
    assert 5.0 < motion.duration_s < 25.0


def test_crouch_is_deep():
    height = crouch().positions_m[:, INDEX["hips"], 2]
    assert height.min() < 0.6 * height[0]


def test_arms_cross():
    positions = arms_crossed().positions_m
    left, right = (positions[:, INDEX[f"{side}_wrist"], 0] for side in ("left", "right"))
    assert (right - left).max() > 0.05


def test_who_leaves_is_seen_no_more_and_comes_back():
    done = perform(leaves_and_returns(), DEFAULT)
    child = PERFORMERS["tuning-child"]
    other = perform(crouch(), child).moved(-1.0, 0.5)
    sensor = find_sensor("azure-kinect")
    stage = DepthStage.of(sensor, standard_rig(1), done, DEFAULT, others=((child, other),))
    low, high = np.array(stage.room.low_m), np.array(stage.room.high_m)
    for performance in (done, other):
        assert (performance.motion.positions_m > low - 0.05).all()
        assert (performance.motion.positions_m < high).all()
    alone = DepthStage.of(sensor, standard_rig(1), done, DEFAULT)
    camera = alone.camera(0)
    far = done.motion.positions_m[:, INDEX["hips"], 0].argmax() / 120
    empty = camera._backdrop.depth_m
    seen = [(camera.view(t).depth_m < empty - 0.05).sum() for t in (1.0, far, done.motion.duration_s)]
    assert seen[0] > 2000 and seen[1] == 0 and seen[2] > 1500
    both = (stage.camera(0).view(1.0).depth_m < empty - 0.05).sum()
    assert both > seen[0] + 500
