"""`python -m tests.engine.seeing.tracker.bars`: the tracker's long figures.

Simulated performers for scoring, six motions, one to three cameras: the mean error of the twelve limb joints, how
many wrong joints are doubted, and how many right ones are; then cold starts.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.model.cameras.depth import DepthFrame
from studio.engine.seeing.tracker.tracker import Tracker
from studio.simulator.body.performers import SCORING, Actor
from studio.simulator.performer.motion import PerformerMotion, perform, read_performance
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage
from tests.engine.seeing.tracker.scenes import LIMBS

HZ = 30
T_POSE_S, BEFORE_S, SECONDS = 2.5, 1.5, 6.0
"""Every motion begins with a T-pose, in which the body's shape is found. The rest of the calibration part is left out
but for a second and a half, in which the tracker finds the performer again; then comes the part that counts."""

OFF_M, DOUBTED, NEAR_M = 0.10, 0.75, 0.03


@dataclass(frozen=True)
class Figures:
    """Errors [m] and confidences, shape (frame_count, 12) each."""

    error_m: NDArray[np.float64]
    confidence: NDArray[np.float64]

    @property
    def mean_cm(self) -> float:
        return float(np.nanmean(self.error_m) * 100)

    @property
    def off_and_doubted(self) -> float:
        """Share of the joints off by more than 10 cm that have a confidence below 0.75."""
        off = self.error_m > OFF_M
        return float((self.confidence[off] < DOUBTED).mean()) if off.any() else float("nan")

    @property
    def near_and_doubted(self) -> float:
        """Share of the joints within 3 cm that have a confidence below 0.75."""
        return float((self.confidence[self.error_m < NEAR_M] < DOUBTED).mean())


def tracked(
    performance: PerformerMotion,
    performer: Actor,
    cameras: int,
    begin_s: float,
    seed: int,
    make: type[Tracker] = Tracker,
) -> Figures:
    """Track the T-pose and a part of a motion from all cameras' points; only the part counts."""
    rig, sensor = standard_rig(cameras), find_sensor("azure-kinect")
    stage = DepthStage.of(sensor, rig, performance, performer, seed=seed)
    images = [stage.camera(index) for index in range(cameras)]
    tracker = make(
        {camera.name: sensor.camera for camera in rig}, {camera.name: camera.T_stage_camera for camera in rig}
    )
    times = np.concatenate([
        np.arange(0.0, T_POSE_S, 1 / HZ), np.arange(begin_s - BEFORE_S, begin_s + SECONDS, 1 / HZ)
    ])  # fmt: skip
    errors, sure = [], []
    for k, t in enumerate(times):
        frames = {
            camera.name: DepthFrame(camera.name, k, round(k / HZ * 1e9) + 1, image.image(float(t)))
            for camera, image in zip(rig, images, strict=True)
        }
        found = tracker.track(frames)
        if t >= begin_s:
            errors.append(np.linalg.norm(found.positions - performance.at(float(t))[0], axis=1)[LIMBS])
            sure.append(found.confidence[LIMBS])
    return Figures(np.array(errors), np.array(sure))


def motions(mocap: Path, performer: Actor) -> Iterator[tuple[str, PerformerMotion, float]]:
    """Name, motion and start of the part that counts [s]: of the embedded performer, and of captures."""
    demo = perform(demo_motion(), performer)
    for name, begin_s in (("swings", 21.0), ("punches", 33.0), ("squat", 41.0)):
        yield name, demo, begin_s
    for name in ("02_05", "49_02", "14_08"):
        whole = read_performance(mocap / f"{name}.bvh", performer, unit_m=0.056444)
        yield name, whole, whole.calibration_s or 0.0


def cold_start(performer: Actor, start_s: float, seed: int) -> bool:
    """Whether the limbs are within 10 cm on average one second after the first image, with one camera."""
    sensor, rig = find_sensor("azure-kinect"), standard_rig(1)
    performance = perform(demo_motion(), performer)
    stage = DepthStage.of(sensor, rig, performance, performer, seed=seed)
    tracker = Tracker({rig[0].name: sensor.camera}, {rig[0].name: rig[0].T_stage_camera})
    for k in range(HZ + 1):
        t = start_s + k / HZ
        image = stage.camera(0).image(t)
        found = tracker.track({rig[0].name: DepthFrame(rig[0].name, k, round(k / HZ * 1e9) + 1, image)})
    return float(np.linalg.norm(found.positions - performance.at(t)[0], axis=1)[LIMBS].mean()) < 0.10


FACING_S = (1.0, 20.5, 27.0, 36.5)
"""Moments of the embedded motion in which the performer faces the camera: T-pose, at rest, arms up, guard."""


def cold_starts() -> list[bool]:
    """Return which of 20 cold starts succeed."""
    starts = [(performer, moment_s) for moment_s in FACING_S for performer in SCORING]
    return [cold_start(performer, moment_s, seed) for seed, (performer, moment_s) in enumerate(starts)]


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mocap", type=Path, default=Path("../shared/data/mocap"))
    parser.add_argument("--bodies", type=int, default=3)
    args = parser.parse_args()
    everything: dict[int, list[Figures]] = {1: [], 2: [], 3: []}
    for seed, performer in enumerate(SCORING[: args.bodies]):
        for name, performance, begin_s in motions(args.mocap, performer):
            for cameras, figures in everything.items():
                found = tracked(performance, performer, cameras, begin_s, seed)
                figures.append(found)
                print(f"{performer.name} {name} {cameras} cameras: {found.mean_cm:.2f} cm", flush=True)
    for cameras, figures in everything.items():
        whole = Figures(
            np.concatenate([f.error_m for f in figures]), np.concatenate([f.confidence for f in figures])
        )
        print(
            f"{cameras} cameras: {whole.mean_cm:.2f} cm; of joints off by 10 cm {whole.off_and_doubted:.2f} doubted, "
            f"within 3 cm {whole.near_and_doubted:.2f}"
        )
    begun = cold_starts()
    print(f"cold starts within 1 s: {sum(begun)} of {len(begun)}")


if __name__ == "__main__":
    main()
