"""Figures of props in depth images: `python -m tests.simulator.prop_figures SHAPE CAMERAS SECONDS [SENSOR]`.

The simulator's performer punches with the prop in the right hand. The truth is used for scoring alone, except for the
performer: the tracker gets the true joints, all moved by one error of 15 mm (standard deviation on each axis), drawn
again for each instant.
"""

import os
import sys
from pathlib import Path

import numpy as np

from studio.engine.model.joints import JOINT_COUNT
from studio.engine.rigid_bodies.known import shape_of
from studio.engine.seeing.props.follow import follow_prop
from studio.engine.seeing.props.sight import PropCamera, SeenImage
from studio.simulator.body.performers import find_performer
from studio.simulator.performer.motion import read_performance
from studio.simulator.performer.prop import HeldProp, holding
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage
from tests.engine.seeing.props.moving import errors

_HZ, _ROOM_IMAGES = 30.0, 24
_LATER_S = (0.0, 0.011, -0.009, 0.005)


def main(text: str, cameras: int, seconds: float, sensor: str) -> None:
    """Print the share of frames in which the prop is followed, and how far it is from its true place."""
    shape, who = shape_of(text), find_performer("scoring-average")
    path = Path(os.environ["STUDIO_TEST_DATA"]) / "mocap" / "02_05.bvh"
    performance = holding(read_performance(path, who, calibration=False), shape, "right_hand")
    prop, rig, kind = HeldProp(shape, performance, "right_hand"), standard_rig(cameras), find_sensor(sensor)
    stage = DepthStage.of(kind, rig, performance, who, props=(prop,))
    times = np.arange(0.0, seconds, 1.0 / _HZ)
    images = [
        [camera.image(max(0.0, time_s + later_s)) for time_s in times.tolist()]
        for camera, later_s in zip(map(stage.camera, range(cameras)), _LATER_S, strict=False)
    ]
    step = max(1, len(times) // _ROOM_IMAGES)
    seen = [
        PropCamera(kind.camera, one.T_stage_camera, mine[::step])
        for one, mine in zip(rig, images, strict=True)
    ]
    rng = np.random.default_rng(0)

    def look(k: int) -> list[SeenImage]:
        moved = rng.normal(0.0, 0.015, (1, 3)).repeat(JOINT_COUNT, axis=0)
        people = [performance.motion.at(float(times[k])) + moved]
        return [one.see(images[i][k], _LATER_S[i], people) for i, one in enumerate(seen)]

    found = follow_prop(times, look, shape)
    if found is None:
        print(f"{text}, {cameras} {sensor}: not found")
        return
    away, degrees = errors(prop, found)
    mm, deg = np.percentile(away, [50, 95]).round(1), np.percentile(degrees, [50, 95]).round(1)
    share = 100 * len(found.time_s) / len(times)
    print(
        f"{text}, {cameras} {sensor}: followed {share:.0f} %, place {mm} mm, axis {deg} degrees (50, 95 %)",
        flush=True,
    )


if __name__ == "__main__":
    main(
        sys.argv[1],
        int(sys.argv[2]),
        float(sys.argv[3]),
        sys.argv[4] if len(sys.argv) > 4 else "azure-kinect",
    )
