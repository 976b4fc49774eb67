"""The parts of the error of ordinary cameras: cameras, size, clocks, floor, body, landmarks.

As `rgb_figures`, but each part of the calibration is replaced by the truth in turn. Run as a program, it prints for
each part the mean error of 15 joints, of hips and neck, and of the other 13. For the last it also prints the constant
error in the axes of the joint's bone and the rest, which moves [mm]; and for each joint the error and its constant
part.
"""

import argparse
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.base.geometry import fit_rigid, transform_points
from studio.engine.calibration.calibrate import calibrate, with_performer
from studio.engine.calibration.quality.verdict import in_shoes
from studio.engine.calibration.views.drift import follow_views
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.model.calibration import Calibration, CameraCalibration, Performer
from studio.engine.model.frames import CameraFrame, ClockModel
from studio.engine.model.joints import INDEX, JOINT_COUNT, MEASURED_JOINTS, to_canonical
from studio.engine.model.settings.settings import preset
from studio.engine.model.triangulation.rays import ACROSS_PER_M, LEAST_ANGLE_RAD, on_rays, placed
from studio.engine.model.triangulation.triangulation import triangulate
from studio.engine.whole_take.take import solve_frames
from studio.simulator.joints.bone_frames import bone_frames
from studio.simulator.landmarks.body import landmarks_of, stature_m
from studio.simulator.landmarks.seen import SeenLandmarks, see_landmarks
from studio.simulator.landmarks.tracker import landmark_anatomy
from studio.simulator.motion import stage_motion
from studio.simulator.rig import RigCamera, standard_rig
from tests.simulator.phones import frames_of

Array = NDArray[np.float64]
NEAR_S = 0.04
COLUMNS = [INDEX[name] for name in MEASURED_JOINTS]
MIDDLES = [MEASURED_JOINTS.index(name) for name in ("hips", "neck")]
OTHERS = [k for k in range(len(COLUMNS)) if k not in MIDDLES]


@dataclass(frozen=True)
class Shot:
    """A simulated recording: frames by camera, each on its own clock, and the truth."""

    motion: CanonicalMotion
    start_s: float
    frames: dict[str, list[CameraFrame]]
    true: Calibration
    anatomy_m: Array


def shoot(path: Path, cameras: int, seed: int) -> Shot:
    """Return the recording of a motion in front of a standard rig."""
    motion, start_s = stage_motion(path)
    assert start_s is not None
    rig = standard_rig(cameras)
    seen = list(see_landmarks(motion, rig, seed=seed))
    frames = {one.camera: _on_own_clock(one) for one in seen}
    lenses = {one.camera: _camera(place, one) for place, one in zip(rig, seen, strict=True)}
    performer = Performer(stature_m(motion.offsets_m), motion.offsets_m, soles_measured=True)
    streams = np.random.SeedSequence(seed).spawn(1)
    anatomy = landmark_anatomy(np.random.default_rng(streams[0]))
    return Shot(
        motion, start_s, frames, Calibration(rig[0].name, lenses, performer, floor_given=True), anatomy
    )


def _on_own_clock(seen: SeenLandmarks) -> list[CameraFrame]:
    stamps = {round(s * 1e9): int(stamp) for s, stamp in zip(seen.taken_s, seen.device_time_ns, strict=True)}
    return [replace(frame, device_time_ns=stamps[frame.device_time_ns]) for frame in frames_of(seen)]


def _camera(place: RigCamera, seen: SeenLandmarks) -> CameraCalibration:
    device_s = seen.device_time_ns * 1e-9
    slope, offset_s = np.polyfit(device_s, seen.taken_s, 1)
    clock = ClockModel(round(offset_s * 1e9), 1e6 * (slope - 1.0))
    return CameraCalibration(place.T_stage_camera, clock, lens=seen.lens)


def places_of(shot: Shot, calibration: Calibration) -> tuple[Array, Array]:
    """Return the joints that the cameras place frame by frame [m], shape (frame_count, 21, 3), and the times [s]."""
    cameras = [calibration.cameras[name] for name in shot.frames]
    times = [
        np.array([camera.clock.stage_ns(frame.device_time_ns) * 1e-9 for frame in frames])
        for camera, frames in zip(cameras, shot.frames.values(), strict=True)
    ]
    centres = np.array([camera.T_stage_camera[:3, 3] for camera in cameras])
    rays, joints = np.ones(len(cameras), dtype=np.bool_), []
    wanted = times[0][times[0] >= shot.start_s]
    for at_s in wanted:
        positions, sure = (
            np.full((len(cameras), JOINT_COUNT, 3), np.nan),
            np.zeros((len(cameras), JOINT_COUNT)),
        )
        for c, (camera, frames) in enumerate(zip(cameras, shot.frames.values(), strict=True)):
            nearest = int(np.abs(times[c] - at_s).argmin())
            picture = frames[nearest].picture
            if picture is not None and abs(times[c][nearest] - at_s) < NEAR_S:
                positions[c], sure[c] = on_rays(camera, picture), frames[nearest].confidence
        ends, sure = placed(positions, sure, centres, rays)
        joints.append(
            triangulate(
                ends, ACROSS_PER_M / np.maximum(sure, 0.05), centres, rays, least_angle_rad=LEAST_ANGLE_RAD
            )
        )
    return np.array(joints), wanted


def told(shot: Shot, joints: Array, times_s: Array, *, size: bool = False) -> tuple[str, float]:
    """Return the errors after one rigid alignment, as text, and the factor by which the joints are too small."""
    true = np.array([shot.motion.at(float(t)) for t in times_s])
    a, b = joints[:, COLUMNS], true[:, COLUMNS]
    known = np.isfinite(a).all(axis=2)
    centred = a[known] - a[known].mean(axis=0), b[known] - b[known].mean(axis=0)
    turned = centred[0] @ fit_rigid(*centred)[:3, :3].T
    scale = float((turned * centred[1]).sum() / (turned**2).sum())
    grown = a * (scale if size else 1.0)
    off = transform_points(fit_rigid(grown[known], b[known]), grown) - b
    length = np.nanmean(np.linalg.norm(off, axis=2), axis=0) * 1e3
    local = np.einsum("fjba,fjb->fja", bone_frames(true, shot.motion.offsets_m)[:, COLUMNS], off)
    fixed = np.nanmean(local, axis=0)
    moving = np.sqrt(np.nanmean(((local - fixed) ** 2).sum(axis=2), axis=0)) * 1e3
    fixed = np.linalg.norm(fixed, axis=1) * 1e3
    joint = " ".join(f"{MEASURED_JOINTS[k]} {length[k]:.0f}/{fixed[k]:.0f}" for k in range(len(COLUMNS)))
    words = (
        f"{length.mean():5.1f} hips {length[MIDDLES[0]]:5.1f} neck {length[MIDDLES[1]]:5.1f} others "
        f"{length[OTHERS].mean():5.1f} constant {fixed[OTHERS].mean():5.1f} moving {moving[OTHERS].mean():5.1f} "
        f"size {100 * (scale - 1):+.2f} %   [{joint}]"
    )
    return words, scale


def aligned(shot: Shot, joints: Array, times_s: Array) -> Array:
    """Return the rigid transform, 4x4, that takes joints to the true ones."""
    true = np.array([shot.motion.at(float(t)) for t in times_s])[:, COLUMNS]
    known = np.isfinite(joints[:, COLUMNS]).all(axis=2)
    return fit_rigid(joints[:, COLUMNS][known], true[known])


def parts(shot: Shot) -> Iterator[tuple[str, str]]:
    """Yield the name of each part and its errors as text."""
    height_m = stature_m(shot.motion.offsets_m)
    times = np.arange(shot.start_s, shot.motion.duration_s, 1 / 30)
    true = np.array([shot.motion.at(float(t)) for t in times])
    seen = landmarks_of(true, shot.motion.offsets_m, shot.anatomy_m)
    sure = np.ones(seen.shape[1])
    yield (
        "landmarks without noise",
        told(shot, np.array([to_canonical("mediapipe", one, sure)[0] for one in seen]), times)[0],
    )
    cameras_only = replace(shot.true, performer=None, floor_given=False)
    until = {
        name: [f for f in frames if f.device_time_ns * 1e-9 < shot.start_s]
        for name, frames in shot.frames.items()
    }
    true_cameras = with_performer(cameras_only, until)
    own = calibrate(shot.frames, until_s=shot.start_s, height_m=in_shoes(height_m))
    own = follow_views(own, shot.frames, shot.start_s)
    if own.refused:
        yield "refused", "; ".join(own.reasons())
        return
    joints, wanted = places_of(shot, own)
    words, _ = told(shot, joints, wanted)
    yield "own, before the solve", words
    yield "the same, size aligned", told(shot, joints, wanted, size=True)[0]
    yield "true cameras, before the solve", told(shot, *places_of(shot, shot.true))[0]
    words, scale = _solved(shot, own)
    yield "own", words
    grown = scaled(own, scale)
    yield "own, true size", _solved(shot, grown)[0]
    clocks = {name: replace(own.cameras[name], clock=shot.true.cameras[name].clock) for name in own.cameras}
    yield "own, true clocks", _solved(shot, replace(own, cameras=clocks))[0]
    T = aligned(shot, *places_of(shot, own))
    level = {name: replace(c, T_stage_camera=T @ c.T_stage_camera) for name, c in own.cameras.items()}
    yield "own, true vertical and floor", _solved(shot, replace(own, cameras=level))[0]
    yield "own, true size and body", _solved(shot, replace(grown, performer=shot.true.performer))[0]
    yield "true cameras", _solved(shot, true_cameras)[0]
    yield "true cameras and body", _solved(shot, shot.true)[0]


def scaled(calibration: Calibration, by: float) -> Calibration:
    """Return the calibration with the stage and the performer scaled."""
    cameras = {}
    for name, camera in calibration.cameras.items():
        T = camera.T_stage_camera.copy()
        T[:3, 3] *= by
        cameras[name] = replace(camera, T_stage_camera=T)
    body = calibration.performer
    assert body is not None
    body = replace(body, height_m=body.height_m * by, offsets_m=body.offsets_m * by)
    return replace(calibration, cameras=cameras, performer=body)


def _solved(shot: Shot, calibration: Calibration) -> tuple[str, float]:
    frames = [frame for mine in shot.frames.values() for frame in mine]
    poses = solve_frames(frames, calibration, preset("finish"), start_s=shot.start_s)
    return told(shot, canonical_positions(poses), poses.time_s)


def main() -> None:
    """Print the errors by part."""
    parser = argparse.ArgumentParser(prog="python -m tests.simulator.rgb_parts", description=__doc__)
    default = os.environ.get("STUDIO_TEST_DATA", Path(__file__).parents[3] / "shared" / "data")
    parser.add_argument("--data", type=Path, default=default, help="folder of the outside recordings")
    parser.add_argument("shots", nargs="+", help="MOTION:CAMERAS:SEED, such as 02_01:4:11")
    chosen = parser.parse_args()
    for one in chosen.shots:
        name, cameras, seed = one.split(":")
        shot = shoot(chosen.data / "mocap" / f"{name}.bvh", int(cameras), int(seed))
        for part, words in parts(shot):
            print(f"{one}, {part}: {words}", flush=True)


if __name__ == "__main__":
    main()
