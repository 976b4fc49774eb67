"""`python -m tests.engine.seeing.tracker.unread`: legs without depth readings, in four ways and ten seeds each.

A leg that no camera reads must hang down naturally, and its joints must be doubted: no joint may be off by more than
10 cm with a confidence over 0.75.
"""

import argparse
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.model.joints import INDEX
from studio.engine.seeing.tracker.tracker import Tracker
from studio.simulator.body.performers import SCORING, Actor
from studio.simulator.performer.motion import perform
from studio.simulator.rig import RigCamera, look_at, standard_rig
from studio.simulator.sensor.room import Box
from studio.simulator.sensor.sensors import Sensor, find_sensor
from studio.simulator.sensor.stage import DepthStage
from tests.engine.seeing.tracker.scenes import LIMBS

HZ = 30
OFF_M, SURE = 0.10, 0.75
PARTS_S = {"T-pose": 0.5, "walk": 5.0, "swings": 21.0, "punches": 33.0, "squat": 41.0}
"""Starts of runs in the embedded motion [s]."""
WAYS = ("range", "trousers", "table", "edge")


@dataclass(frozen=True)
class Run:
    """One run: errors [m] and confidences of the limbs' joints, shape (frame_count, 12) each; by frame and camera,
    why it does not show the legs."""

    error_m: NDArray[np.float64]
    confidence: NDArray[np.float64]
    legs_unread: list[Mapping[str, str]]

    @property
    def believed(self) -> NDArray[np.bool_]:
        """Which joints are off but believed."""
        return (self.error_m > OFF_M) & (self.confidence > SURE)


def scene(way: str, seed: int, performer: Actor, begin_s: float) -> tuple[DepthStage, tuple[RigCamera, ...]]:
    """Return a stage whose cameras read nothing, or something else, below the height of the knees."""
    rng = np.random.default_rng([seed, WAYS.index(way)])
    count = 1 + seed % 3
    sensor, rig = find_sensor("azure-kinect"), standard_rig(count)
    performance = perform(demo_motion(), performer)
    joints = performance.at(begin_s)[0]
    knees = joints[[INDEX["left_knee"], INDEX["right_knee"]]].mean(axis=0)
    height = knees[2] + rng.uniform(-0.1, 0.15)
    boxes: tuple[Box, ...] = ()
    if way == "range":
        rig = tuple(_above(camera) for camera in rig)
        sensor = _ends_at(sensor, rig, np.array([knees[0], knees[1], height]))
    elif way == "trousers":
        shirt, _, hair, skin, _ = performer.albedo
        dark = rng.uniform(0.005, 0.03)
        performer = replace(performer, trouser=1.9, albedo=(shirt, dark, hair, skin, dark))
    elif way == "table":
        boxes = tuple(_before(camera, knees[:2], height) for camera in rig)
    else:
        rig = tuple(_raised(camera, sensor, np.array([knees[0], knees[1], height])) for camera in rig)
    stage = DepthStage.of(sensor, rig, performance, performer, seed=seed)
    return replace(stage, room=replace(stage.room, boxes=boxes)), rig


def _above(camera: RigCamera) -> RigCamera:
    """Return the camera at 2.2 m, where the feet are farther along its axis than the chest."""
    x, y, _ = camera.T_stage_camera[:3, 3]
    return RigCamera(camera.name, look_at(np.array([x, y, 2.2]), np.array([0.0, 0.0, 1.0])))


def _ends_at(sensor: Sensor, rig: tuple[RigCamera, ...], place: NDArray[np.float64]) -> Sensor:
    """Return the sensor with a range that ends at the place as seen from the nearest camera."""
    z = [float((place - camera.T_stage_camera[:3, 3]) @ camera.T_stage_camera[:3, 2]) for camera in rig]
    return replace(sensor, range_m=(sensor.range_m[0], min(z)))


def _before(camera: RigCamera, place: NDArray[np.float64], height: float) -> Box:
    """Return a board 1.2 m in front of the performer that hides everything below a height."""
    eye = camera.T_stage_camera[:3, 3]
    away = eye[:2] - place
    share = 1.2 / float(np.linalg.norm(away))
    top = height + share * (eye[2] - height)
    middle = place + share * away
    yaw = float(np.arctan2(away[1], away[0]))
    return Box((middle[0], middle[1], top / 2), (0.02, 0.9, top / 2), yaw)


def _raised(camera: RigCamera, sensor: Sensor, place: NDArray[np.float64]) -> RigCamera:
    """Return the camera turned up until a place lies at the lower edge of its picture."""
    eye = camera.T_stage_camera[:3, 3]
    flat = place[:2] - eye[:2]
    below = np.arctan2(eye[2] - place[2], np.linalg.norm(flat))
    half = np.arctan2(sensor.camera.height - sensor.camera.cy, sensor.camera.fy)
    up = np.tan(half - below)
    aim = eye + np.array([flat[0], flat[1], up * np.linalg.norm(flat)])
    return RigCamera(camera.name, look_at(eye, aim))


def run(way: str, seed: int, part: str, seconds: float = 2.0, make: type[Tracker] = Tracker) -> Run:
    """Track a performer who begins with legs that are not read."""
    performer = SCORING[seed % len(SCORING)]
    begin_s = PARTS_S[part]
    stage, rig = scene(way, seed, performer, begin_s)
    images = [stage.camera(index) for index in range(len(rig))]
    tracker = make(
        {camera.name: stage.sensor.camera for camera in rig},
        {camera.name: camera.T_stage_camera for camera in rig},
    )
    errors, sure, why = [], [], []
    for k, t in enumerate(np.arange(begin_s, begin_s + seconds, 1 / HZ)):
        frames = {
            camera.name: DepthFrame(camera.name, k, round(k / HZ * 1e9) + 1, image.image(float(t)))
            for camera, image in zip(rig, images, strict=True)
        }
        found = tracker.track(frames)
        errors.append(np.linalg.norm(found.positions - stage.performance.at(float(t))[0], axis=1)[LIMBS])
        sure.append(found.confidence[LIMBS])
        why.append(found.legs_unread)
    return Run(np.array(errors), np.array(sure), why)


def part_of(way: str, seed: int) -> str:
    """Return the seed's part of the motion: each seed has another performer, number of cameras and part."""
    parts = tuple(PARTS_S)
    return parts[(seed + WAYS.index(way)) % len(parts)]


def runs(ways: Iterable[str], seeds: Sequence[int]) -> Iterator[tuple[str, int, str, Run]]:
    """Run ways with some seeds."""
    for way in ways:
        for seed in seeds:
            part = part_of(way, seed)
            yield way, seed, part, run(way, seed, part)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    parser.add_argument("--seeds", nargs="+", type=int, default=range(10))
    args = parser.parse_args()
    names = [
        f"{side[0]}_{name}"
        for side in ("left", "right")
        for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
    ]
    for way, seed, part, done in runs(args.ways, args.seeds):
        bad = done.believed
        where = ", ".join(f"{names[j]} {int(bad[:, j].sum())}" for j in np.flatnonzero(bad.any(axis=0)))
        found = np.isfinite(done.error_m[:, 0])
        cm = 100 * done.error_m[found]
        print(
            f"{way} {seed} ({1 + seed % 3} cameras, {SCORING[seed % len(SCORING)].name}, {part}): followed "
            f"{found.mean():.0%}, limbs {cm.mean():.1f} cm, knees {cm[:, [4, 10]].mean():.1f} cm, ankles "
            f"{cm[:, [5, 11]].mean():.1f} cm, believed and off {int(bad.sum())}: {where}",
            flush=True,
        )


if __name__ == "__main__":
    main()
