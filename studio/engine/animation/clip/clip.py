"""From a solve to the content of a file: trimming, clean-up, the frame rate, then names, bones and root motion.

All formats share `prepared_poses`; `clip` continues to a skeleton with keys.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from studio.engine.animation.clip.foot_lock import foot_locked
from studio.engine.animation.clip.kinematics import check_poses
from studio.engine.animation.clip.looping import looped
from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.clip.resample import frames_of, resampled, standard_rate
from studio.engine.animation.clip.skeleton import LocalMotion, local_motion, with_keys_every
from studio.engine.animation.clip.smoothing import smoothed
from studio.engine.animation.clip.targets import on_target
from studio.engine.animation.clip.timecode import timecode_seconds
from studio.engine.base.errors import SettingsError
from studio.engine.model.poses import Poses

_MOST_STEPS = 4
"""Maximum number of steps between two keys; a cubic has no freedom for more than three inner places."""


def prepared_poses(poses: Poses, options: ExportOptions) -> Poses:
    """Return the poses trimmed, cleaned up, and on a uniform grid of `options.fps`.

    The order is trimming, smoothing (at the take's own rate), the rate, the loop, foot lock. Times stay those of
    the stage.

    Raises:
        FormatError: poses that cannot be exported.
        SettingsError: the take has no frame in the requested part.
    """
    return _prepared(poses, options, 1)


def clip(
    poses: Poses,
    options: ExportOptions,
    onto: Callable[[LocalMotion, ExportOptions], LocalMotion] | None = None,
) -> LocalMotion:
    """Return the poses as a skeleton with keys: `prepared_poses`, then root motion and the target's bones.

    Where the poses have more frames than the clip has cubic keys, `between` holds the motion between the keys.

    Args:
        poses: the solve.
        options: of the export.
        onto: moves the motion onto other bones than a target's (`retarget`), with its path.

    Raises:
        FormatError: poses that cannot be exported.
        SettingsError: options that do not fit the poses.
    """
    steps = _steps(poses, options)
    prepared = _prepared(poses, options, steps)
    motion = local_motion(prepared)
    if onto is None:
        motion = on_target(motion, options.target, options.root_motion)
    else:
        motion = onto(motion, options)
    motion = with_keys_every(motion, steps)
    if options.fps is not None:
        motion = replace(motion, frames_per_second=standard_rate(options.fps))
    start_s, timecode = 0.0, None
    if options.timecodes is not None:
        timecode = options.timecodes.timecodes_at(prepared.time_s[:1])[0]
        start_s = timecode.seconds
    elif options.timecode is not None:
        into_take = prepared.begins_s - poses.begins_s
        start_s = timecode_seconds(options.timecode, motion.frames_per_second) + into_take
    return replace(
        motion,
        name=options.take_name,
        start_s=start_s,
        timecode=timecode,
        undecided_s=_undecided_s(prepared, options),
    )


def _undecided_s(prepared: Poses, options: ExportOptions) -> tuple[tuple[float, float], ...] | None:
    """Return the undecided spans within the prepared poses [s from their first frame]."""
    if options.undecided_s is None:
        return None
    begins_s, ends_s = prepared.begins_s, float(prepared.time_s[-1])
    return tuple(
        (round(max(begin, begins_s) - begins_s, 6), round(min(end, ends_s) - begins_s, 6))
        for begin, end in options.undecided_s
        if begin <= ends_s and end >= begins_s
    )


def _steps(poses: Poses, options: ExportOptions) -> int:
    """Return the number of motion steps from key to key that improve a curve."""
    if options.fps is None or options.interpolation != "cubic":
        return 1
    return int(np.clip(np.ceil(poses.frames_per_second / options.fps - 0.01), 1, _MOST_STEPS))


def _prepared(poses: Poses, options: ExportOptions, steps: int) -> Poses:
    """Return prepared poses at `steps` times the rate."""
    check_poses(poses)
    poses = _trimmed(poses, options)
    if options.smooth_hz is not None:
        poses = smoothed(resampled(poses)[0], options.smooth_hz)
    poses, _ = resampled(poses, None if options.fps is None else steps * options.fps, steps=steps)
    if options.loop:
        poses = looped(poses, steps)
    return foot_locked(poses) if options.foot_lock else poses


def _trimmed(poses: Poses, options: ExportOptions) -> Poses:
    """Return the frames from `start_s` to `end_s` after the first one."""
    if options.start_s is None and options.end_s is None:
        return poses
    since = poses.time_s - poses.begins_s
    start = 0.0 if options.start_s is None else options.start_s
    end = np.inf if options.end_s is None else options.end_s
    inside = np.flatnonzero((since >= start - 1e-6) & (since <= end + 1e-6))
    if inside.size == 0:
        raise SettingsError(
            "export.start",
            "start={start:g}: the take has {seconds:.2f} s; choose a part of it",
            start=start,
            seconds=since[-1],
        )
    return frames_of(poses, slice(inside[0], inside[-1] + 1))
