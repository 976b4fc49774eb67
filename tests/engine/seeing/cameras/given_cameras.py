"""`python -m tests.engine.seeing.cameras.given_cameras [--draws N] [--performers N]`: cameras that are a little off.

The performers for scoring wash, comb and fold their arms in front of two Kinect v2. The cameras are given 4 mm and
0.15 degrees off (standard deviation on each axis). Each run prints one line: how far limbs and wrists are off with
the cameras as given and refined, as the mean over the frames after the T-pose and one rigid alignment of the run, as
in `studio evaluate`; and how far apart the two cameras place a thing at the performer's place. The first runs have
exact cameras.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.base.geometry import fit_rigid, invert_transform, make_transform, transform_points
from studio.engine.model.calibration import Calibration, CameraCalibration
from studio.engine.model.cameras.depth import DepthCamera, DepthFrame
from studio.engine.model.joints import INDEX
from studio.engine.seeing.cameras.refine import RefinedCameras, refine_cameras
from studio.engine.seeing.tracker.tracker import Tracker
from studio.offline.placing import windows
from studio.simulator.body.performers import SCORING, Actor
from studio.simulator.performer.motion import perform
from studio.simulator.rig import standard_rig
from studio.simulator.sensor.sensors import find_sensor
from studio.simulator.sensor.stage import DepthStage
from tests.engine.seeing.cameras.hands_at_body import T_POSE_S, hands_at_body
from tests.engine.seeing.tracker.scenes import LIMBS

Array = NDArray[np.float64]
Placed = dict[str, Array]

HZ = 30
PLACE_SD_M, TURN_SD_DEG = 0.004, 0.15
WRISTS = [INDEX["left_wrist"], INDEX["right_wrist"]]
MOST_WRISTS_M, MOST_LIMBS_M = 0.06, 0.038
_BOX = np.array([[x, y, z] for x in (-0.4, 0.4) for y in (-0.3, 0.3) for z in (0.1, 1.0, 1.7)])


@dataclass(frozen=True)
class Watched:
    """What two cameras see of a motion: intrinsics, true places, image sets, true joints, shape (F, 21, 3)."""

    cameras: dict[str, DepthCamera]
    placed: Placed
    sets: list[dict[str, DepthFrame]]
    truth: Array


@dataclass(frozen=True)
class Errors:
    """Mean errors of a run [m]: wrists and limbs; and how far apart the cameras place a thing at the performer."""

    wrists_m: float
    limbs_m: float
    apart_m: float

    @property
    def within(self) -> bool:
        return self.wrists_m < MOST_WRISTS_M and self.limbs_m < MOST_LIMBS_M

    def __str__(self) -> str:
        cameras = f"{self.apart_m * 1e3:.1f} mm"
        return f"wrists {self.wrists_m * 100:.1f} cm, limbs {self.limbs_m * 1e3:.1f} mm, cameras {cameras}"


def watched(
    performer: Actor, motion: CanonicalMotion, *, seconds: float | None = None, seed: int = 0, hz: float = HZ
) -> Watched:
    """Return what two Kinect v2 see of a motion, or of its first seconds."""
    rig, sensor = standard_rig(2), find_sensor("kinect-v2")
    performance = perform(motion, performer)
    stage = DepthStage.of(sensor, rig, performance, performer, seed=seed)
    images = [stage.camera(index) for index in range(len(rig))]
    times = np.arange(0.0, motion.duration_s if seconds is None else seconds, 1 / hz)
    sets = [
        {
            camera.name: DepthFrame(camera.name, k, round(t * 1e9) + 1, image.image(float(t)))
            for camera, image in zip(rig, images, strict=True)
        }
        for k, t in enumerate(times)
    ]
    return Watched(
        {camera.name: sensor.camera for camera in rig},
        {camera.name: camera.T_stage_camera for camera in rig},
        sets,
        np.stack([performance.at(float(t))[0] for t in times]),
    )


def a_little_off(placed: Placed, draw: int) -> Placed:
    """Return cameras with the errors of boards and tape measures."""
    rng = np.random.default_rng(draw)
    out = {}
    for name, T in placed.items():
        turn = Rotation.from_rotvec(np.radians(rng.normal(0.0, TURN_SD_DEG, 3))).as_matrix()
        out[name] = make_transform(T[:3, :3] @ turn, T[:3, 3] + rng.normal(0.0, PLACE_SD_M, 3))
    return out


def refined(seen: Watched, given: Placed) -> RefinedCameras:
    """Return the cameras refined as a solve does it."""
    calibration = Calibration(next(iter(given)), {name: CameraCalibration(T) for name, T in given.items()})
    times = [next(iter(images.values())).device_time_ns for images in seen.sets]
    spans = windows(times[0], times[-1])
    frames = [
        image
        for images, time_ns in zip(seen.sets, times, strict=True)
        if any(begin <= time_ns <= end for begin, end in spans)
        for image in images.values()
    ]
    return refine_cameras(frames, seen.cameras, calibration)


def errors(seen: Watched, placed: Placed, begin_s: float = T_POSE_S) -> Errors:
    """Track with cameras at some places, and return the errors."""
    tracker = Tracker(seen.cameras, placed)
    found = np.stack([tracker.track(images).positions for images in seen.sets])[round(begin_s * HZ) :]
    truth = seen.truth[round(begin_s * HZ) :]
    known = np.isfinite(found).all(axis=(1, 2))
    T = fit_rigid(found[known][:, LIMBS].reshape(-1, 3), truth[known][:, LIMBS].reshape(-1, 3))
    off = np.linalg.norm(transform_points(T, found[known]) - truth[known], axis=2)
    return Errors(float(off[:, WRISTS].mean()), float(off[:, LIMBS].mean()), apart_m(placed, seen.placed))


def apart_m(placed: Placed, true: Placed) -> float:
    """Return how far apart two cameras place a thing at the performer's place [m]."""
    first, second = (transform_points(placed[n] @ invert_transform(true[n]), _BOX) for n in placed)
    return float(np.linalg.norm(first - second, axis=1).mean())


def runs(draws: range, performers: tuple[Actor, ...]) -> Iterator[tuple[str, int, Errors, Errors, str]]:
    """Yield performer, draw (0 = exact cameras), errors with the cameras given and refined, and how they moved."""
    scenes = {performer: watched(performer, hands_at_body(performer)) for performer in performers}
    for draw in draws:
        for performer, seen in scenes.items():
            given = a_little_off(seen.placed, draw) if draw else seen.placed
            moved = refined(seen, given)
            placed = {name: moved.calibration.cameras[name].T_stage_camera for name in given}
            yield performer.name, draw, errors(seen, given), errors(seen, placed), moved.line()


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--draws", type=int, nargs=2, default=(0, 10), help="first and last; 0 = exact cameras"
    )
    parser.add_argument("--performers", type=int, nargs="*", default=range(len(SCORING)))
    args = parser.parse_args()
    counted: list[tuple[Errors, Errors]] = []
    first, last = args.draws
    for name, draw, before, after, line in runs(
        range(first, last + 1), tuple(SCORING[k] for k in args.performers)
    ):
        print(f"{name} {draw} | given: {before} | refined: {after} | {line}", flush=True)
        if draw:
            counted.append((before, after))
    for k, what in enumerate(("given", "refined")):
        print(f"{what}: {sum(run[k].within for run in counted)} of {len(counted)} within")


if __name__ == "__main__":
    main()
