"""Fingers seen by ordinary cameras, against the truth: simulated hands, true cameras, live and finished.

A figure is the mean distance of the 15 finger joints from the true ones, both relative to their wrists. It covers the
frames in which the hand has 60 pixels or more in every picture, seen or not.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.authored import demo_motion
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.base.geometry import matrices
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import CameraFrame, ClockModel, PictureJoints
from studio.engine.model.human.face import seen_in
from studio.engine.model.human.skeleton import Skeleton
from studio.engine.model.joints import FINGERS, INDEX, OUTPUT_INDEX, to_canonical
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import parse_settings
from studio.engine.whole_take.take import solve_frames
from studio.simulator.landmarks.fingers import SimulatedHands
from studio.simulator.landmarks.hand_tracker import LEAST_PIXELS, HandTracker
from studio.simulator.landmarks.seen import SeenLandmarks, see_landmarks
from studio.simulator.rig import RigCamera, look_at

DISTANCE_M = 2.6
ANGLES_DEG = (0.0, -50.0, 50.0)
START_S = 4.0
"""Where the motion begins in the demo, after its T-pose."""

BAR_MM, LIVE_BAR_MM = 12.0, 13.0
"""Bars of a finished take, and live."""

JOINTS = [4 * finger + k for finger in range(5) for k in range(3)]
"""Columns of the finger joints among the landmarks after the wrist; the tips are left out."""


def rig() -> tuple[RigCamera, ...]:
    """Return three cameras in front of the performer, near enough that hands have 60 pixels."""
    return tuple(
        RigCamera(
            f"camera_{k}",
            look_at(
                np.array([DISTANCE_M * np.sin(a), -DISTANCE_M * np.cos(a), 1.1 + 0.3 * k]),
                np.array([0.0, 0.0, 1.0]),
            ),
        )
        for k, a in enumerate(np.radians(ANGLES_DEG))
    )


def motion(seconds: float) -> CanonicalMotion:
    """Return the beginning of the demo after its T-pose."""
    whole = demo_motion()
    rows = slice(round(START_S / whole.frame_s), round((START_S + seconds) / whole.frame_s))
    return replace(whole, positions_m=whole.positions_m[rows], hands_open=whole.hands_open[rows])


@dataclass(frozen=True)
class SeenStage:
    """Cameras' frames of one performance, the true calibration, and the true hands."""

    motion: CanonicalMotion
    frames: list[CameraFrame]
    calibration: Calibration
    hands: SimulatedHands
    seen: list[SeenLandmarks]
    seed: int


def seen_stage(seconds: float, seed: int, cameras: tuple[RigCamera, ...] | None = None) -> SeenStage:
    """Return what cameras see of the performer and the hands; None = the cameras of `rig`."""
    acted = motion(seconds)
    cameras = cameras or rig()
    seen = list(see_landmarks(acted, cameras, seed=seed))
    calibrated, frames = {}, []
    for camera, own in zip(cameras, seen, strict=True):
        clock = _clock(own)
        calibrated[camera.name] = CameraCalibration(camera.T_stage_camera, lens=own.lens, clock=clock)
        for k, (stamp, picture) in enumerate(zip(own.device_time_ns.tolist(), own.pictures, strict=True)):
            if picture is None:
                continue
            flat = np.column_stack([picture.pixels, np.zeros(33)])
            pixels, confidence = to_canonical("mediapipe", flat, picture.visibility)
            world_m, _ = to_canonical("mediapipe", picture.world_m, picture.visibility)
            face = seen_in("mediapipe", picture.pixels, picture.visibility)
            joints = PictureJoints(
                own.lens.width, own.lens.height, pixels[:, :2], world_m, picture.hands, face
            )
            unseen = np.full((21, 3), np.nan)
            frames.append(CameraFrame(camera.name, k, stamp, unseen, confidence, picture=joints))
    height = float(acted.positions_m[0, :, 2].max()) + 0.12
    calibration = Calibration(cameras[0].name, calibrated, Performer(height, acted.offsets_m))
    return SeenStage(acted, frames, calibration, SimulatedHands(acted.offsets_m, seed), seen, seed)


def _clock(seen: SeenLandmarks) -> ClockModel:
    slope, offset = np.polyfit(seen.device_time_ns * 1e-9, seen.taken_s, 1)
    return ClockModel(round(offset * 1e9), (slope - 1.0) * 1e6, 0)


def errors_mm(stage: SeenStage, poses: Poses, calibration: Calibration) -> NDArray[np.float64]:
    """Return the mean errors of each hand in each frame, shape (F, 2) [mm]; NaN where it is too small or unseen."""
    assert calibration.performer is not None
    skeleton = Skeleton.of(calibration.performer)
    trackers = [
        HandTracker(camera.T_stage_camera, own.lens, stage.hands, seed=stage.seed, camera=0)
        for camera, own in zip(rig(), stage.seen, strict=True)
    ]
    out = np.full((len(poses.time_s), 2), np.nan)
    rotations = matrices(poses.rotations_wxyz)
    for row, time_s in enumerate(poses.time_s.tolist()):
        joints = stage.motion.at(time_s)
        truth = stage.hands.points(joints, time_s)
        for k, side in enumerate(("Left", "Right")):
            wrist = joints[INDEX[f"{side.lower()}_wrist"]]
            if min(tracker.hand_pixels(wrist) for tracker in trackers) < LEAST_PIXELS:
                continue
            found = _hand(poses.positions_m[row], rotations[row], skeleton, side)
            off = (found[1:] - found[0]) - (truth[k, 1:] - truth[k, 0])
            out[row, k] = 1e3 * np.linalg.norm(off[JOINTS], axis=1).mean()
    return out


def _hand(
    positions: NDArray[np.float64], rotations: NDArray[np.float64], skeleton: Skeleton, side: str
) -> NDArray[np.float64]:
    points = [positions[OUTPUT_INDEX[f"{side}Hand"]]]
    for finger in FINGERS:
        names = [f"{side}Hand{finger}{k}" for k in (1, 2, 3)]
        points += [positions[OUTPUT_INDEX[name]] for name in names]
        points.append(points[-1] + rotations[OUTPUT_INDEX[names[2]]] @ skeleton.finger_tip_m(names[2]))
    return np.array(points)


def figures(stage: SeenStage, preset: str, changes: Sequence[str] = ()) -> NDArray[np.float64]:
    """Return `errors_mm` of a solve."""
    poses = solve_frames(stage.frames, stage.calibration, parse_settings(preset, list(changes)))
    return errors_mm(stage, poses, stage.calibration)


def main() -> None:
    """Print the errors by preset and seed."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulator.finger_figures", description=__doc__)
    parser.add_argument("--seconds", type=float, default=40.0, help="length of the performance")
    parser.add_argument(
        "--seeds", type=int, nargs="*", default=(1, 2, 3, 4), help="performers, hands and noise"
    )
    chosen = parser.parse_args()
    solves = {"live": ("studio", []), "finished": ("finish", []), "without": ("studio", ["fingers=off"])}
    found: dict[str, list[NDArray[np.float64]]] = {name: [] for name in solves}
    for seed in chosen.seeds:
        stage = seen_stage(chosen.seconds, seed)
        for name, (preset, changes) in solves.items():
            errors = figures(stage, preset, changes)
            found[name].append(errors[np.isfinite(errors)])
            print(f"seed {seed}, {name}: {_line(found[name][-1])}", flush=True)
    for name, parts in found.items():
        print(f"all, {name}: {_line(np.concatenate(parts))}; the bar is {BAR_MM:g} mm")


def _line(errors: NDArray[np.float64]) -> str:
    return (
        f"mean {errors.mean():.1f} mm, median {np.median(errors):.1f}, "
        f"95 % {np.percentile(errors, 95):.1f}, {len(errors)} hands"
    )


if __name__ == "__main__":
    main()
