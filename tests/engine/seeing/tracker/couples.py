"""Depth images of two simulated people."""

from dataclasses import replace
from functools import cache

import numpy as np

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.model.cameras.depth import DepthFrame
from studio.simulator.body.performers import TUNING, Actor
from studio.simulator.performer.motion import PerformerMotion, perform
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage

RATE_HZ = 15.0


def couple(first, second, *, cameras=1, seconds=1.0, begin_s=0.0, enters_s=0.0):
    """Intrinsics, transforms, image sets and true joints, shape (2, F, 21, 3), of two people who do the demo.

    `first`, `second`: from seconds since the beginning to places on the floor [m], shape (F, 2), relative to the
    demo's own. `begin_s`: start in the demo, which begins with a T-pose. `enters_s`: when the second person enters.
    """
    rig, sensor = standard_rig(cameras), find_sensor("azure-kinect")
    done = []
    for way, performer in ((first, TUNING[0]), (second, TUNING[1])):
        one = _performed(performer)
        places = np.zeros((one.motion.frame_count, 3))
        places[:, :2] = way(one.motion.times_s() - begin_s)
        moved = replace(one.motion, positions_m=one.motion.positions_m + places[:, None])
        done.append(replace(one, motion=moved))
    done[1] = replace(done[1], enters_s=begin_s + enters_s)
    stage = DepthStage.of(sensor, rig, done[0], TUNING[0], others=((TUNING[1], done[1]),))
    images = [stage.camera(index) for index in range(cameras)]
    times = begin_s + np.arange(0.0, seconds, 1 / RATE_HZ)
    sets = [
        {
            camera.name: DepthFrame(camera.name, k, round(t * 1e9) + 1, image.image(float(t)))
            for camera, image in zip(rig, images, strict=True)
        }
        for k, t in enumerate(times)
    ]
    truth = np.stack([[one.at(float(t))[0] for t in times] for one in done])
    return (
        {camera.name: sensor.camera for camera in rig},
        {camera.name: camera.T_stage_camera for camera in rig},
        sets,
        truth,
    )


@cache
def _performed(performer: Actor) -> PerformerMotion:
    return perform(demo_motion(), performer, acts=False)


def stays(x_m, y_m=0.0):
    """Stand at a place."""
    return lambda times: np.tile([x_m, y_m], (len(times), 1))


def goes(begin, end, begin_s, seconds):
    """Go from one place to another."""

    def way(times):
        share = np.clip((times - begin_s) / seconds, 0.0, 1.0)[:, None]
        return np.array(begin) + share * (np.array(end) - np.array(begin))

    return way
