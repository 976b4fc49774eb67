"""`studio simulate`: a take of simulated cameras that watch a known motion, and the truth beside it."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from studio import wire
from studio.camera.simulator.depth import sensors
from studio.camera.simulator.noisy_joints import FRAMES_PER_SECOND
from studio.camera.simulator.rig import RigCamera, read_rig, standard_rig
from studio.camera.simulator.seen import see
from studio.engine.animation.files import canonical_animation
from studio.engine.errors import FormatError, SettingsError, TakeError
from studio.engine.files import write_atomically
from studio.engine.joints import CANONICAL, INDEX
from studio.engine.motion.authored import calibration_motion, demo_motion
from studio.engine.motion.body import TOE_HEIGHT_M
from studio.engine.motion.keys import RATE_HZ
from studio.engine.motion.motion import CanonicalMotion
from studio.take.new import new_take
from studio.take.raw import RawWriter
from studio.take.take import Take

SENSORS: tuple[str, ...] = tuple(sensors.SENSORS)
DEMO = "demo"
"""The motion that is not a file: the embedded performer's."""

TRACKERS = ("noisy-joints", "depth")
_FEET = [INDEX[f"{side}_{joint}"] for side in ("left", "right") for joint in ("ankle", "toe")]


def simulate_take(
    motion_path: str | Path,
    out: str | Path,
    *,
    cameras: int = 1,
    sensor: str = "ideal",
    tracker: str = "noisy-joints",
    seed: int = 0,
    unit_m: float | None = None,
    rig: str | Path | None = None,
    calibration: bool = True,
    performer: str = "tuning-average",
    furniture: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Path:
    """Record a motion with simulated cameras; return the path of the take.

    The true joint centres go to `<out>.truth.csv`, on the clock of the reference camera (the first), 120 Hz.

    Args:
        motion_path: an animation that `animation.files` reads; the first frame of a BVH, a rest pose, is dropped; or
            `demo`, the embedded performer.
        out: folder of the new take.
        cameras: 1 to 4 of the standard rigs; ignored with `rig`.
        sensor: of `depth`. The noise of `noisy-joints` is the same contract (see `noisy_joints`) whatever the
            sensor, `ideal` too.
        tracker: `noisy-joints`, or `depth`: the take holds depth images, from which `solve` finds the joints.
        seed: of all noise and clocks; the same seed gives the same frames.
        unit_m: metres per unit of the BVH; None = its rest pose is 1.75 m high.
        rig: JSON with the cameras instead of a standard rig; see `rig.read_rig`.
        calibration: begin with 3 s of T-pose and 30 s of walking.
        performer: whose body depth cameras see, and whose proportions the truth has then; see `depth.performers`.
        furniture: depth cameras see a shelf, a table and a chair.
        progress: called with the share done, 0..1.

    Raises:
        FormatError: a motion or rig that cannot be used. TakeError: `out`, or the truth beside it, exists.
        SettingsError: an unknown sensor, tracker or performer, or a negative seed.
    """
    _check(sensor, tracker, seed)
    out = Path(out)
    truth_path = out.resolve().parent / f"{out.resolve().name}.truth.csv"
    if truth_path.exists():
        raise TakeError(f"{truth_path} exists; choose another take, or delete it")
    stage_rig = standard_rig(cameras) if rig is None else read_rig(rig)
    write: Callable[[Take], None]
    if tracker == "depth":
        write, truth, calibration_s = _depth(
            motion_path, stage_rig, sensor, performer, furniture, seed, unit_m, calibration, progress
        )
    else:
        motion, calibration_s = stage_motion(motion_path, unit_m=unit_m, calibration=calibration)
        write, truth = partial(_record, motion, stage_rig, sensor, seed, progress), _truth_csv(motion)
    try:
        with new_take(
            out, source="simulate", calibration_s=calibration_s, notes=f"simulated: {Path(motion_path).name}"
        ) as take:
            write(take)
            with write_atomically(truth_path) as file:
                file.write(truth)
    except BaseException:
        truth_path.unlink(missing_ok=True)  # it did not exist before
        raise
    return out


def _check(sensor: str, tracker: str, seed: int) -> None:
    if sensor not in SENSORS:
        raise SettingsError(f"unknown sensor {sensor!r}; allowed: {', '.join(SENSORS)}")
    if tracker not in TRACKERS:
        raise SettingsError(f"unknown tracker {tracker!r}; allowed: {', '.join(TRACKERS)}")
    if seed < 0:
        raise SettingsError(f"seed {seed} is not allowed; allowed: a whole number from 0")


def stage_motion(
    path: str | Path, *, unit_m: float | None = None, calibration: bool = True
) -> tuple[CanonicalMotion, float | None]:
    """Return a motion on the stage at 120 Hz, after its calibration part, and that part's length [s].

    The path of the hips is centred over the stage's origin; the feet at their lowest stand on the floor.

    Raises:
        FormatError: see `canonical_animation`; or fewer than two frames are left.
    """
    embedded = str(path) == DEMO
    source = demo_motion() if embedded else canonical_animation(path, unit_m=unit_m)
    positions = source.positions_m[1 if has_rest_frame(path) else 0 :]
    if len(positions) < 2:
        raise FormatError(
            f"{path} has {source.frame_count} frames; two are needed, and a BVH's first one is dropped"
        )
    return staged(replace(source, positions_m=positions), calibration=calibration)


def staged(source: CanonicalMotion, *, calibration: bool = True) -> tuple[CanonicalMotion, float | None]:
    """Return a motion of joints on the stage, as `stage_motion` does with that of a file."""
    positions = source.positions_m
    hips = positions[:, INDEX["hips"], :2]
    floor = np.percentile(positions[:, _FEET, 2].min(axis=1), 2) - TOE_HEIGHT_M
    positions = positions - [*((hips.min(axis=0) + hips.max(axis=0)) / 2), floor]
    positions = _resample(positions, source.frame_s)
    calibration_s = None
    if calibration:
        before = calibration_motion(source.offsets_m)
        calibration_s = before.frame_count * before.frame_s
        positions = np.concatenate([before.positions_m, positions])
    hands = np.ones((len(positions), 2))
    return CanonicalMotion(1 / RATE_HZ, positions, source.offsets_m, hands), calibration_s


def has_rest_frame(path: str | Path) -> bool:
    """Whether the motion's first frame is a rest pose: that of a BVH."""
    return Path(path).suffix.lower() == ".bvh"


def _resample(positions: NDArray[np.float64], frame_s: float) -> NDArray[np.float64]:
    times = np.arange(len(positions)) * frame_s
    return CubicSpline(times, positions)(np.arange(int(times[-1] * RATE_HZ + 1e-6) + 1) / RATE_HZ)


def _depth(
    motion_path: str | Path,
    rig: tuple[RigCamera, ...],
    sensor: str,
    performer: str,
    furniture: bool,
    seed: int,
    unit_m: float | None,
    calibration: bool,
    progress: Callable[[float], None] | None,
) -> tuple[Callable[[Take], None], bytes, float | None]:
    """What records depth, the truth, and the length of the part for calibration [s]."""
    from studio.camera.simulator.depth.motion import read_performance
    from studio.camera.simulator.depth.performers import find_performer
    from studio.camera.simulator.depth.recording import record_depth, truth_csv
    from studio.camera.simulator.depth.stage import DepthStage

    who = find_performer(performer)
    performance = read_performance(motion_path, who, unit_m=unit_m, calibration=calibration)
    stage = DepthStage.of(sensors.find_sensor(sensor), rig, performance, who, seed=seed, furniture=furniture)

    def write(take: Take) -> None:
        record_depth(take, stage, progress)

    return write, truth_csv(performance), performance.calibration_s


def _record(
    motion: CanonicalMotion,
    rig: tuple[RigCamera, ...],
    sensor: str,
    seed: int,
    progress: Callable[[float], None] | None,
    take: Take,
) -> None:
    messages = []
    for k, seen in enumerate(see(motion, rig, seed=seed)):
        for sequence, stamp in enumerate(seen.device_time_ns):
            frame = wire.skeleton_frame(
                sequence, int(stamp), seen.positions_m[sequence], seen.confidence[sequence]
            )
            messages.append((seen.taken_s[sequence], seen.camera, frame))
        if progress is not None:
            progress(0.9 * (k + 1) / len(rig))
    messages.sort(key=lambda message: message[0])
    with RawWriter(take.raw_path) as raw:
        for camera in rig:
            hello = wire.Hello(
                protocol_version=wire.PROTOCOL_VERSION,
                name=camera.name,
                device=f"simulated {sensor}",
                joint_set="canonical",
                boot_id=f"simulate-{seed}",
                frames_per_second=FRAMES_PER_SECOND,
            )
            raw.add_camera(hello)
            take.add_camera(hello)
        for time_s, name, frame in messages:
            raw.frame(
                name,
                wire.encode(frame),
                arrival_ns=round(time_s * 1e9),
                device_time_ns=frame.device_time_ns,
                sequence=frame.sequence,
            )
    if progress is not None:
        progress(1.0)


def _truth_csv(motion: CanonicalMotion) -> bytes:
    header = "time_s," + ",".join(f"{name}_{axis}" for name in CANONICAL for axis in "xyz")
    rows = np.column_stack([motion.times_s(), motion.positions_m.reshape(motion.frame_count, -1)])
    lines = (",".join([f"{row[0]:.5f}", *(f"{value:.4f}" for value in row[1:])]) for row in rows)
    return "\n".join([header, *lines, ""]).encode()
