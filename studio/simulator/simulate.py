"""`studio simulate`: a take of simulated cameras that watch a known motion, and its ground truth."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from studio import wire
from studio.engine.animation.motion.motion import CanonicalMotion
from studio.engine.base.errors import SettingsError, TakeError
from studio.engine.base.files import write_atomically
from studio.engine.base.value_sentences import bad_value, unknown
from studio.engine.model.joints import CANONICAL
from studio.simulator.crowd.meeting import MEETINGS, Meeting, meet
from studio.simulator.joints.noisy_joints import FRAMES_PER_SECOND
from studio.simulator.joints.seen import see
from studio.simulator.landmarks.body import stature_m
from studio.simulator.landmarks.fingers import LANDMARKS, SimulatedHands
from studio.simulator.landmarks.seen import see_landmarks
from studio.simulator.motion import stage_motion
from studio.simulator.rig import RigCamera, read_rig, standard_rig
from studio.simulator.sensor import sensors
from studio.take.folder.new import new_take
from studio.take.folder.take import Take
from studio.take.raw.frames import RawWriter

SENSORS: tuple[str, ...] = tuple(sensors.SENSORS)
Progress = Callable[[float], None]
Recorded = tuple[Callable[[Take], None], list[bytes]]
"""Writer of a take's frames, and the truth of each performer."""

TRACKERS = ("noisy-joints", "depth", "rgb")
_PROP_HAND = "right_hand"


def simulate_take(
    motion_path: str | Path | Sequence[str | Path],
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
    meeting: str = "passing",
    prop: str | None = None,
    progress: Progress | None = None,
) -> Path:
    """Record a motion with simulated cameras; return the path of the take.

    The notes of a take of landmarks give the performer's height, for its calibration.

    The true joint centres go to `<out>.truth.csv`, on the clock of the reference camera (the first), 120 Hz. With
    `rgb` it also has each hand's 21 landmarks, `left_hand_0` (the wrist) and so on.

    Args:
        motion_path: an animation that `animation.read.files` reads, without the first frame of a BVH, which is a rest
            pose; or `demo`, the embedded performer. Several paths: one performer each; the first walks for the
            calibration, and their true joints go to `<out>.truth.performer_1.csv` and so on.
        out: folder of the new take.
        cameras: 1 to 4 of the standard rigs; ignored with `rig`.
        sensor: of `depth`. `noisy-joints` has the same noise (see `noisy_joints`) for all, `ideal` included.
        tracker: `noisy-joints`; `depth`: depth images, from which `solve` finds the joints; or `rgb`: landmarks in
            pictures of ordinary cameras, see `landmarks.tracker`.
        seed: of all noise and clocks; the same seed gives the same frames.
        unit_m: metres per unit of the BVH; None = its rest pose is 1.75 m high.
        rig: JSON with the cameras instead of a standard rig; see `rig.read_rig`.
        calibration: begin with 3 s of T-pose and 30 s of walking.
        performer: body for depth cameras, which sets the proportions of the truth; see `body.performers`.
        furniture: depth cameras see a shelf, a table and a chair.
        meeting: how several performers move about one another, a key of `crowd.meeting.MEETINGS`.
        prop: shape of a prop in the right hand for depth cameras, such as `cylinder:3,90` (cm); its true poses go to
            `<out>.truth.prop.csv`.
        progress: called with the share done, 0..1.

    Raises:
        FormatError: a motion or rig that cannot be used.
        TakeError: `out` or its truth exists.
        SettingsError: an unknown sensor, tracker or performer, a negative seed, or a prop without `depth` or for
            several performers.
    """
    _check(sensor, tracker, seed)
    several = not isinstance(motion_path, str | Path) and len(motion_path) > 1
    if prop is not None and (tracker != "depth" or several):
        raise SettingsError(
            "simulator.prop",
            "prop={prop}: depth cameras see a prop in the hand of one performer; give --tracker depth and one motion",
            prop=prop,
        )
    out = Path(out)
    if not isinstance(motion_path, str | Path):
        if len(motion_path) > 1:
            crowd: Callable[..., Recorded] = _record_crowd
            if tracker == "depth":
                from studio.simulator.crowd.depth import record_crowd_depth

                crowd = partial(record_crowd_depth, sensor=sensor, performer=performer, furniture=furniture)
            elif tracker != "noisy-joints":
                raise SettingsError(
                    "simulator.one_performer",
                    "tracker={tracker}: shows one performer; several go with noisy-joints and depth",
                    tracker=tracker,
                )
            stage_rig = standard_rig(cameras) if rig is None else read_rig(rig)
            return _several(motion_path, out, stage_rig, crowd, seed, unit_m, meeting, progress)
        (motion_path,) = motion_path
    truth_path = out.resolve().parent / f"{out.resolve().name}.truth.csv"
    prop_path = truth_path.with_name(f"{out.resolve().name}.truth.prop.csv")
    for path in (truth_path, *(() if prop is None else (prop_path,))):
        if path.exists():
            raise _truth_exists(path)
    stage_rig = standard_rig(cameras) if rig is None else read_rig(rig)
    notes = f"simulated: {Path(motion_path).name}"
    write: Callable[[Take], None]
    truths = {}
    if tracker == "depth":
        write, truth, calibration_s, of_prop = _depth(
            motion_path, stage_rig, sensor, performer, furniture, seed, unit_m, calibration, prop, progress
        )
        if of_prop is not None:
            truths[prop_path] = of_prop
    else:
        motion, calibration_s = stage_motion(motion_path, unit_m=unit_m, calibration=calibration)
        record = _record_landmarks if tracker == "rgb" else partial(_record, sensor=sensor)
        write = partial(record, motion, stage_rig, seed=seed, progress=progress)
        truth = _truth_csv(motion, SimulatedHands(motion.offsets_m, seed) if tracker == "rgb" else None)
        if tracker == "rgb":
            notes += f"; the performer is {stature_m(motion.offsets_m):.2f} m tall"
    try:
        with new_take(out, source="simulate", calibration_s=calibration_s, notes=notes) as take:
            write(take)
            for path, csv in {truth_path: truth, **truths}.items():
                with write_atomically(path) as file:
                    file.write(csv)
    except BaseException:
        for path in (truth_path, *truths):
            path.unlink(missing_ok=True)  # it did not exist before
        raise
    return out


def _several(
    paths: Sequence[str | Path],
    out: Path,
    rig: tuple[RigCamera, ...],
    record: Callable[..., Recorded],
    seed: int,
    unit_m: float | None,
    meeting: str,
    progress: Progress | None,
) -> Path:
    """Record several performers at once; see `simulate_take`."""
    if meeting not in MEETINGS:
        raise SettingsError(unknown("meeting", meeting, MEETINGS))
    folder, stem = out.resolve().parent, out.resolve().name
    truths = [folder / f"{stem}.truth.performer_{k + 1}.csv" for k in range(len(paths))]
    for path in truths:
        if path.exists():
            raise _truth_exists(path)
    together = meet([stage_motion(path, unit_m=unit_m, calibration=False)[0] for path in paths], meeting)
    write, csvs = record(together, rig, seed=seed, progress=progress)
    names = ", ".join(Path(path).name for path in paths)
    try:
        with new_take(
            out,
            source="simulate",
            calibration_s=together.calibration_s,
            notes=f"simulated: {names}, {meeting}",
        ) as take:
            write(take)
            for path, csv in zip(truths, csvs, strict=True):
                with write_atomically(path) as file:
                    file.write(csv)
    except BaseException:
        for path in truths:
            path.unlink(missing_ok=True)  # it did not exist before
        raise
    if progress is not None:
        progress(1.0)
    return out


def _record_crowd(
    together: Meeting, rig: tuple[RigCamera, ...], *, seed: int, progress: Progress | None
) -> Recorded:
    """Return a function that records several performers' skeletons, and the truth of each."""
    from studio.simulator.crowd.seen import see_crowd

    def write(take: Take) -> None:
        messages = []
        for k, seen in enumerate(see_crowd(together, rig, seed=seed)):
            for sequence, (stamp, bodies) in enumerate(zip(seen.device_time_ns, seen.bodies, strict=True)):
                frames = [
                    wire.skeleton_frame(
                        sequence, int(stamp), one.positions_m, one.confidence, body=one.number
                    )
                    for one in bodies
                ]
                if frames:
                    frame = wire.with_others(frames[0], frames[1:])
                    messages.append((seen.taken_s[sequence], seen.camera, frame))
            if progress is not None:
                progress(0.9 * (k + 1) / len(rig))
        _write(take, rig, messages, "simulated ideal", "canonical", seed)

    parts = zip(together.motions, together.enters_s, strict=True)
    return write, [_truth_csv(motion, None, enters_s) for motion, enters_s in parts]


def _truth_exists(path: Path) -> TakeError:
    return TakeError("simulator.truth_exists", "{path} exists; choose another take, or delete it", path=path)


def _check(sensor: str, tracker: str, seed: int) -> None:
    if sensor not in SENSORS:
        raise SettingsError(unknown("sensor", sensor, SENSORS))
    if tracker not in TRACKERS:
        raise SettingsError(unknown("tracker", tracker, TRACKERS))
    if seed < 0:
        raise SettingsError(bad_value("seed", seed, "a whole number from 0"))


def _depth(
    motion_path: str | Path,
    rig: tuple[RigCamera, ...],
    sensor: str,
    performer: str,
    furniture: bool,
    seed: int,
    unit_m: float | None,
    calibration: bool,
    prop: str | None,
    progress: Progress | None,
) -> tuple[Callable[[Take], None], bytes, float | None, bytes | None]:
    """A function that records depth, the truth, the length of the calibration part [s], and the truth of the prop."""
    from studio.engine.rigid_bodies.known import shape_of
    from studio.simulator.body.performers import find_performer
    from studio.simulator.performer.motion import read_performance
    from studio.simulator.performer.prop import HeldProp, holding
    from studio.simulator.sensor.recording import record_depth, truth_csv
    from studio.simulator.sensor.stage import DepthStage

    who = find_performer(performer)
    performance = read_performance(motion_path, who, unit_m=unit_m, calibration=calibration)
    held = None
    if prop is not None:
        shape = shape_of(prop)
        performance = holding(performance, shape, _PROP_HAND)
        held = HeldProp(shape, performance, _PROP_HAND)
    stage = DepthStage.of(
        sensors.find_sensor(sensor), rig, performance, who, seed=seed, furniture=furniture,
        props=() if held is None else (held,),
    )  # fmt: skip

    def write(take: Take) -> None:
        record_depth(take, stage, progress)

    return (
        write,
        truth_csv(performance),
        performance.calibration_s,
        None if held is None else held.truth_csv(),
    )


def _record(
    motion: CanonicalMotion,
    rig: tuple[RigCamera, ...],
    take: Take,
    *,
    sensor: str,
    seed: int,
    progress: Progress | None,
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
    _write(take, rig, messages, f"simulated {sensor}", "canonical", seed)
    if progress is not None:
        progress(1.0)


def _record_landmarks(
    motion: CanonicalMotion,
    rig: tuple[RigCamera, ...],
    take: Take,
    *,
    seed: int,
    progress: Progress | None,
) -> None:
    messages = []
    for k, seen in enumerate(see_landmarks(motion, rig, seed=seed)):
        size = seen.lens.width, seen.lens.height
        for sequence, (stamp, picture) in enumerate(zip(seen.device_time_ns, seen.pictures, strict=True)):
            if picture is not None:
                hands = picture.hand(0), picture.hand(1)
                arrays = wire.LandmarkArrays(*size, picture.pixels, picture.world_m, *hands)
                frame = wire.landmark_frame(sequence, int(stamp), arrays, picture.visibility)
                messages.append((seen.taken_s[sequence], seen.camera, frame))
        if progress is not None:
            progress(0.9 * (k + 1) / len(rig))
    _write(take, rig, messages, "simulated picture", "mediapipe", seed)
    if progress is not None:
        progress(1.0)


def _write(
    take: Take,
    rig: tuple[RigCamera, ...],
    messages: list[tuple[float, str, wire.SkeletonFrame]],
    device: str,
    joint_set: str,
    seed: int,
) -> None:
    """Write the cameras' messages, (true time [s], camera, frame), in time order."""
    messages.sort(key=lambda message: message[0])
    with RawWriter(take.raw_path) as raw:
        for camera in rig:
            hello = wire.Hello(
                protocol_version=wire.PROTOCOL_VERSION,
                name=camera.name,
                device=device,
                joint_set=joint_set,
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


def _truth_csv(motion: CanonicalMotion, hands: SimulatedHands | None, from_s: float = 0.0) -> bytes:
    names, positions = list(CANONICAL), motion.positions_m
    if hands is not None:
        names += [f"{side}_hand_{k}" for side in ("left", "right") for k in range(LANDMARKS)]
        times = motion.times_s().tolist()
        fingers = [hands.points(joints, time_s) for joints, time_s in zip(positions, times, strict=True)]
        positions = np.concatenate([positions, np.reshape(fingers, (len(positions), -1, 3))], axis=1)
    header = "time_s," + ",".join(f"{name}_{axis}" for name in names for axis in "xyz")
    rows = np.column_stack([motion.times_s(), positions.reshape(motion.frame_count, -1)])
    rows = rows[rows[:, 0] >= from_s]
    lines = (",".join([f"{row[0]:.5f}", *(f"{value:.4f}" for value in row[1:])]) for row in rows)
    return "\n".join([header, *lines, ""]).encode()
