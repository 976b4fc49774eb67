"""`python -m tests.engine.seeing.tracker.hand_bars`: the long figures of the hand states and the head.

Adult performers for scoring do captures on which nothing was tuned, in front of one camera at 2 and at 3 m: how often
each method is right about a hand, and how often it gives no answer. A hand counts in every frame in which it is at
least 80 % open or closed, even right after a change. It shows if the image has its knuckles within 9 cm of their
depth.
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.geometry import invert_transform, matrices, transform_points
from studio.engine.model.cameras.depth import DepthCamera
from studio.engine.model.joints import INDEX
from studio.engine.seeing.observer import Observer
from studio.simulator.body.bones import BONE
from studio.simulator.body.performers import Actor, find_performer
from studio.simulator.performer.motion import PerformerMotion, read_performance
from studio.simulator.rig import RigCamera, look_at
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage

HZ = 30
T_POSE_S, BEFORE_S, SECONDS = 2.5, 1.5, 8.0
"""As in `bars`: a T-pose, in which the body's shape is found, a moment before the motion, then what counts."""

RUNS = (
    ("scoring-average", "02_05", "kinect-v2"), ("scoring-slim", "49_02", "azure-kinect"),
    ("scoring-heavy", "02_05", "azure-kinect"), ("scoring-tall", "49_02", "kinect-v2"),
)  # fmt: skip
DISTANCES_M = (2.0, 3.0)
YAW_RAD, HEIGHT_M = np.radians(20.0), 1.4
UNKNOWN = (0.35, 0.65)
SURE_OPEN, SURE_CLOSED, SHOWN_M = 0.8, 0.2, 0.09


@dataclass(frozen=True)
class HandFrame:
    """One method's answer about one hand in one frame."""

    method: str
    shows: bool
    is_open: bool
    probability: float

    @property
    def known(self) -> bool:
        return not UNKNOWN[0] < self.probability < UNKNOWN[1]

    @property
    def right(self) -> bool:
        return self.known and (self.probability > 0.5) == self.is_open


def camera_at(performance: PerformerMotion, begin_s: float, distance_m: float) -> RigCamera:
    """Return a camera in front of the performer, a little aside, at this distance in the middle of what counts."""
    middle = performance.motion.at(begin_s + SECONDS / 2)[INDEX["hips"]]
    joints = performance.motion.at(begin_s)
    across = joints[INDEX["left_shoulder"]] - joints[INDEX["right_shoulder"]]
    angle = np.arctan2(-across[0], across[1]) + YAW_RAD
    eye = np.array([*(middle[:2] + distance_m * np.array([np.cos(angle), np.sin(angle)])), HEIGHT_M])
    return RigCamera("camera", look_at(eye, middle))


def shows(camera: DepthCamera, depth_mm: NDArray[np.uint16], place: NDArray[np.float64]) -> bool:
    """Whether the image shows what is at a place of the camera frame [m]."""
    column, row = np.rint(camera.pixels_of(place)).astype(int)
    if not (0 <= column < depth_mm.shape[1] and 0 <= row < depth_mm.shape[0]):
        return False
    patch = depth_mm[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] * 1e-3
    return bool((np.abs(patch - place[2]) < SHOWN_M).mean() >= 0.25)


def observed(
    performance: PerformerMotion, performer: Actor, sensor: str, distance_m: float
) -> Iterator[HandFrame | float]:
    """Yield a client's results: hands, and the errors of the head's angle [degrees]."""
    begin_s = performance.calibration_s or 0.0
    device, rig = find_sensor(sensor), camera_at(performance, begin_s, distance_m)
    image = DepthStage.of(device, (rig,), performance, performer, seed=4).camera(0)
    observer, T_camera_stage = Observer("camera", device.camera), invert_transform(rig.T_stage_camera)
    times = np.concatenate([
        np.arange(0.0, T_POSE_S, 1 / HZ), np.arange(begin_s - BEFORE_S, begin_s + SECONDS, 1 / HZ)
    ])  # fmt: skip
    for k, t in enumerate(times[times < performance.motion.times_s()[-1]]):
        depth_mm = image.image(float(t))
        found = observer.observe(round(k / HZ * 1e9) + 1, depth_mm)
        if t < begin_s:
            continue
        joints = transform_points(T_camera_stage, performance.motion.at(float(t)))
        openness = performance.motion.hands_open_at(float(t))
        for side, value in zip(("left", "right"), openness, strict=True):
            if SURE_CLOSED < value < SURE_OPEN:
                continue
            answers = {hand.method: hand.open_probability for hand in found.hands if hand.side == side}
            seen = shows(device.camera, depth_mm, joints[INDEX[f"{side}_hand"]])
            for method in ("shape", "circles"):
                yield HandFrame(method, seen, value > SURE_OPEN, answers.get(method, 0.5))
        if found.head_wxyz is not None:
            true = matrices(performance.at(float(t))[1][BONE["head"]][None])[0]
            turn = (T_camera_stage[:3, :3] @ true).T @ matrices(np.asarray(found.head_wxyz)[None])[0]
            yield float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1.0, 1.0))))


def summary(frames: list[HandFrame]) -> str:
    """Return how often answers were right and how often unknown, in all frames and where the hand shows."""

    def shares(some: list[HandFrame]) -> str:
        right, known = (np.mean([getattr(f, name) for f in some]) * 100 for name in ("right", "known"))
        return f"{right:.1f} % right, {100 - known:.1f} % unknown"

    return f"{shares(frames)}; where it shows {shares([f for f in frames if f.shows])} ({len(frames)} hands)"


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mocap", type=Path, default=Path("../shared/data/mocap"))
    parser.add_argument("--runs", type=int, default=len(RUNS))
    args = parser.parse_args()
    hands: dict[tuple[str, str], list[HandFrame]] = defaultdict(list)
    heads: dict[float, list[float]] = defaultdict(list)
    for name, clip, sensor in RUNS[: args.runs]:
        performer = find_performer(name)
        performance = read_performance(args.mocap / f"{clip}.bvh", performer, unit_m=0.056444)
        for distance_m in DISTANCES_M:
            run = list(observed(performance, performer, sensor, distance_m))
            frames = [answer for answer in run if isinstance(answer, HandFrame)]
            for method in ("shape", "circles"):
                own = [frame for frame in frames if frame.method == method]
                for key in (f"{distance_m:.0f} m", sensor, "all"):
                    hands[method, key] += own
                print(f"{name} {clip} {sensor} {distance_m:.0f} m, {method}: {summary(own)}", flush=True)
            heads[distance_m] += [answer for answer in run if isinstance(answer, float)]
    for (method, key), frames in sorted(hands.items()):
        print(f"{method}, {key}: {summary(frames)}")
    for distance_m, angles in heads.items():
        print(f"head at {distance_m:.0f} m: median {np.median(angles):.1f} degrees ({len(angles)} frames)")


if __name__ == "__main__":
    main()
