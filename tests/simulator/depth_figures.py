"""How well the depth tracker follows two performers who embrace, one who lifts the other's arm, and one who lies down
across the other's feet: errors of the limbs, exchanges, and how often somebody is not tracked."""

import argparse
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.animation.motion.keys import RATE_HZ
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.model.joints import INDEX
from studio.engine.seeing.tracker.tracked import TrackedSkeleton
from studio.engine.seeing.tracker.tracker import Tracker
from studio.simulator.crowd.depth import depth_stage
from studio.simulator.crowd.meeting import GOING_S, T_POSE_S, Meeting, meet
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor

IMAGES_HZ = 15.0
HELD_S = 1.0
LIMBS = [
    INDEX[f"{side}_{joint}"]
    for side in ("left", "right")
    for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
]
_FALL_S = 1.5
_LIES_M = 0.12


def scene(way: str, seconds: float) -> Meeting:
    """Return two performers who hold a T-pose side by side for a second, and then meet for this many seconds."""
    demo = demo_motion()
    together = meet([demo, demo], "apart" if way == "lying" else way)
    begins = round((together.calibration_s + GOING_S + T_POSE_S - HELD_S) * RATE_HZ)
    length = round((HELD_S + GOING_S + seconds) * RATE_HZ)
    motions = [
        replace(one, positions_m=one.positions_m[begins : begins + length], hands_open=np.ones((length, 2)))
        for one in together.motions
    ]
    if way == "lying":
        motions[1] = replace(motions[1], positions_m=lying_down(motions[1].positions_m))
    return Meeting(tuple(motions), (0.0, 0.0), 0.0)


def lying_down(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a T-pose that tips over sideways towards the other one, and lies across their feet with arms out."""
    pose = positions[0]
    times = np.arange(len(positions)) / RATE_HZ - HELD_S
    angle = np.clip(times / _FALL_S, 0.0, 1.0) * np.pi / 2
    foot = pose[INDEX["left_ankle"]] * [1.0, 1.0, 0.0]
    turned = np.array([Rotation.from_rotvec([one, 0.0, 0.0]).apply(pose - foot) for one in angle])
    lifted = np.sin(angle)[:, None, None] * [0.0, 0.0, _LIES_M]
    turn = Rotation.from_rotvec([0.0, 0.0, np.pi / 2])  # falls backward, then towards the other
    across = np.array([turn.apply(one) for one in turned])
    return across + foot + lifted


def rendered(way: str, seconds: float, cameras: int):
    """Return the cameras by name, their transforms, image sets, and true joints, shape (2, F, 21, 3)."""
    rig, sensor = standard_rig(cameras), find_sensor("azure-kinect")
    stage = depth_stage(scene(way, seconds), rig, sensor, "tuning-average")
    of_cameras = [stage.camera(index) for index in range(cameras)]
    times = np.arange(0.0, HELD_S + GOING_S + seconds - 0.05, 1 / IMAGES_HZ)
    sets = [
        {
            camera.name: DepthFrame(camera.name, k, round(t * 1e9) + 1, images.image(float(t)))
            for camera, images in zip(rig, of_cameras, strict=True)
        }
        for k, t in enumerate(times)
    ]
    done = (stage.performance, *(other for _, other in stage.others))
    truth = np.stack([[one.at(float(t))[0] for t in times] for one in done])
    placed = {camera.name: camera.T_stage_camera for camera in rig}
    return {camera.name: sensor.camera for camera in rig}, placed, sets, truth


def told(skeletons: list[TrackedSkeleton], truth: NDArray[np.float64]) -> str:
    """Return the figures of a tracker's skeletons in the stage frame."""
    off: list[list[float]] = [[], []]
    bodies: list[dict[int, int]] = [{}, {}]
    changes, lost = 0, np.zeros(2, dtype=int)
    last = [-1, -1]
    for k, skeleton in enumerate(skeletons):
        own = [one for one in skeleton.each() if one.status == "tracked"]
        apart = np.array(
            [[np.linalg.norm((one.positions - who[k])[LIMBS], axis=1).mean() for one in own] for who in truth]
        ).reshape(2, -1)
        found = dict(zip(*linear_sum_assignment(apart), strict=True)) if own else {}
        for who in range(2):
            if who not in found or apart[who, found[who]] > 0.6:
                lost[who] += 1
                continue
            body = own[found[who]].body
            off[who].append(float(apart[who, found[who]]))
            bodies[who][body] = bodies[who].get(body, 0) + 1
            changes += last[who] not in (-1, body)
            last[who] = body
    mean = " and ".join(f"{1e3 * np.mean(one):.0f} (95 % {1e3 * np.percentile(one, 95):.0f})" for one in off)
    return f"{mean} mm, {changes} changes, not tracked {lost[0]} and {lost[1]} of {len(skeletons)}, {bodies}"


def main() -> None:
    """Print the figures of each scene, from all cameras' points and from each camera alone."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulator.depth_figures", description=__doc__)
    parser.add_argument("--ways", nargs="+", default=["embracing", "lifting", "lying"])
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--cameras", type=int, default=3)
    chosen = parser.parse_args()
    for way in chosen.ways:
        cameras, placed, sets, truth = rendered(way, chosen.seconds, chosen.cameras)
        tracker = Tracker(cameras, placed)
        print(f"{way}, points: {told([tracker.track(images) for images in sets], truth)}", flush=True)
        for name in cameras:
            alone = Tracker({name: cameras[name]}, {name: placed[name]})
            seen = [alone.track({name: images[name]}) for images in sets]
            print(f"{way}, {name} alone: {told(seen, truth)}", flush=True)


if __name__ == "__main__":
    main()
