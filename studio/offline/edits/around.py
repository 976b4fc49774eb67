"""The surroundings of an instant solved with edits, for a first look before the whole take is solved."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import ceil

import numpy as np

from studio.engine.animation.clip.kinematics import local_keys, world_poses
from studio.engine.animation.clip.resample import at_times, frames_of
from studio.engine.base.quaternions import blended
from studio.engine.edits.edit import Edit
from studio.engine.edits.timing import eased, of_performer
from studio.engine.model.frames import CameraFrame
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings
from studio.engine.whole_take.mending.frames import edited_frames
from studio.engine.whole_take.mending.pinned import REACH_S
from studio.engine.whole_take.take import solve_frames
from studio.offline.preview import frames_between, poses_between, seen_performer
from studio.take.folder.take import PERFORMER, Take
from studio.take.rigid_bodies.used import pins_of

AROUND_S = 1.5
"""How far before and after the instant is solved [s]."""

LOOK_HZ = 30
"""Highest rate at which these frames are solved, because a first look is wanted within a second."""

LEAD_S = 0.5
"""Lead-in, in which the filter converges [s]."""

BLEND_S = 0.4
"""Time in which the whole solve becomes the preview, and back [s]."""


def solve_around(
    take: Take,
    settings: SolveSettings,
    edits: Sequence[Edit],
    at_s: float,
    *,
    performer: str = PERFORMER,
    stored: Poses | None = None,
    progress: Callable[[float], None] | None = None,
) -> Poses:
    """Return poses from `AROUND_S` before an instant to as long after it, solved with edits.

    Nothing is stored. The whole solve may differ a little: these frames are solved alone, at `LOOK_HZ` at most, and
    preset `finish` without physics. The first call in a process reads the take's frames; they are kept for the next
    one. Pass the full name to a worker that stays: `run_in_process("studio.offline.edits.around:solve_around", take,
    settings, edits, at_s, performer=..., stored=...)`.

    Args:
        take: with raw frames and a calibration.
        settings: of the solve that is mended.
        edits: all of the take; those that are on and of this performer count.
        at_s: the instant, stage time [s].
        performer: whose poses.
        stored: the whole solve that is mended. With it the poses that are returned are at its instants, begin and end
            in it, and stay on its floor. None = the poses as they are solved.
        progress: receives the share done.

    Raises:
        TakeError: no frames around the instant, or depth that was not tracked with these settings yet.
        CalibrationError: the take has no calibration, or no performer.
    """
    begin_s, end_s = at_s - AROUND_S, at_s + AROUND_S
    every = ceil(settings.output_hz / LOOK_HZ)
    settings = replace(settings, physics="off", output_hz=settings.output_hz // every)
    one = seen_performer(take, settings, performer)
    calibration, mine = one.calibration, of_performer(edits, one.name)
    parts = {
        name: frames_between(own, calibration, name, begin_s - REACH_S, end_s + REACH_S)
        for name, own in one.frames.items()
        if name in calibration.cameras
    }
    mended = edited_frames(parts, calibration, mine, lifted_m=one.lift_of_pins_m(mine))
    first_ns, last_ns = (begin_s - LEAD_S) * 1e9, (end_s + LEAD_S) * 1e9
    part: list[CameraFrame] = []
    for name, own in mended.items():
        clock = calibration.cameras[name].clock
        part += [frame for frame in own if first_ns <= clock.stage_ns(frame.device_time_ns) <= last_ns]
    poses = solve_frames(
        part,
        calibration,
        one.settings,
        progress=progress,
        pins=pins_of(take, one.name, mine, calibration.performer),
    )
    found = poses_between(take, poses, begin_s, end_s)
    return found if stored is None else blended_into(found, stored)


def blended_into(found: Poses, stored: Poses) -> Poses:
    """Return poses at the instants of a whole solve, blended from it at their beginning and to it at their end, on
    its floor.

    Args:
        found: a part, solved again.
        stored: the whole solve, of the same skeleton.
    """
    first, last = np.searchsorted(stored.time_s, [found.time_s[0] - 1e-4, found.time_s[-1] + 1e-4])
    beside = frames_of(stored, slice(int(first), int(last)))
    if beside.frame_count < 2 or beside.joint_names != found.joint_names:
        return found
    found = at_times(found, np.clip(beside.time_s, *found.time_s[[0, -1]]))
    to_edge = np.minimum(beside.time_s - beside.time_s[0], beside.time_s[-1] - beside.time_s)
    share = eased(to_edge / BLEND_S)
    near = to_edge < BLEND_S
    up = float(np.median((beside.positions_m[:, 0, 2] - found.positions_m[:, 0, 2])[near]))
    new_offsets, new = local_keys(found.parents, found.positions_m, found.rotations_wxyz)
    offsets, own = local_keys(beside.parents, beside.positions_m, beside.rotations_wxyz)
    new_offsets[:, 0, 2] += up
    mixed = blended(own, new, share[:, None, None])
    moved = (1.0 - share[:, None, None]) * offsets + share[:, None, None] * new_offsets
    positions, rotations = world_poses(found.parents, moved, mixed)
    return replace(
        frames_of(beside, slice(None)),
        positions_m=positions,
        rotations_wxyz=rotations,
        confidence=found.confidence,
        uncertainty_mm=found.uncertainty_mm,
    )
