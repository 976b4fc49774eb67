"""Splicing: successive parts of one performer's motion, joined into one motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studio.engine.animation.clip.kinematics import check_poses
from studio.engine.animation.clip.looping import features_of
from studio.engine.animation.clip.resample import frames_of, resampled
from studio.engine.animation.splicing.seam import Piece, blended, put_on, with_feet_at
from studio.engine.base.errors import SettingsError
from studio.engine.model.poses import Poses

LEAST_FRAMES = 3
"""Shortest seam, and shortest rest of a part without its seams [frames]."""

MOST_S = 10.0

OTHER_BODY = 0.1
"""Relative difference in bone length above which skeletons are of different performers."""


@dataclass(frozen=True)
class Part:
    """A part of a solve.

    Attributes:
        poses: the whole solve.
        start_s, end_s: the part, stage time [s]; None = from its first frame, to its last.
    """

    poses: Poses
    start_s: float | None = None
    end_s: float | None = None


@dataclass(frozen=True)
class Spliced:
    """A spliced motion.

    Attributes:
        poses: on the first part's skeleton, aligned with it, at its rate; the first frame is at 0 s.
        spans_s: start and end of each part in its own solve [s], as used.
        seams_s: start and end of each seam [s].
    """

    poses: Poses
    spans_s: tuple[tuple[float, float], ...]
    seams_s: tuple[tuple[float, float], ...]


def spliced(parts: Sequence[Part], *, blend_s: float, near_s: float) -> Spliced:
    """Return parts one after the other: the end of each is blended into the start of the next.

    Each part is turned about the vertical and moved over the floor to continue the one before it. The last
    `blend_s` of a part and the first `blend_s` of the next are one seam, so the motion is that much shorter.

    Args:
        parts: of one performer, with the same joints; rates may differ.
        blend_s: length of each seam [s].
        near_s: largest shift of a part's start, to the frame most similar to the end of the part before [s];
            0 = no shift.

    Raises:
        SettingsError: no part, another skeleton or body, a part that is too short, a length that is not allowed.
        FormatError: see `check_poses`.
    """
    if not parts:
        raise SettingsError("splice.none", "there is nothing to splice; give at least one part of a solve")
    for name, value, most in (("blend_s", blend_s, MOST_S), ("near_s", near_s, MOST_S)):
        if not 0.0 <= value <= most:
            raise SettingsError(
                "splice.length",
                "{name}={value}: allowed is 0 to {most:g} s",
                name=name,
                value=value,
                most=most,
            )
    for part in parts:
        check_poses(part.poses)
    rate = resampled(parts[0].poses)[1]
    whole = [resampled(part.poses, rate)[0] for part in parts]
    rows = [_rows(poses, part) for poses, part in zip(whole, parts, strict=True)]
    count = max(LEAST_FRAMES, round(blend_s * rate))
    _check(whole, rows, count, rate)
    for k in range(1, len(rows)):
        least = (1 + (k + 1 < len(rows))) * count + LEAST_FRAMES
        end = frames_of(whole[k - 1], slice(rows[k - 1].stop - count, rows[k - 1].stop))
        rows[k] = slice(_likest(end, whole[k], rows[k], least, round(near_s * rate)), rows[k].stop)
    pieces = [Piece.of(poses).part(own) for poses, own in zip(whole, rows, strict=True)]
    spans = [(float(one.poses.time_s[0]), float(one.poses.time_s[-1])) for one in pieces]
    for k in range(1, len(pieces)):
        pieces[k] = put_on(pieces[k - 1], pieces[k], count)
    done: list[Poses] = []
    seams: list[tuple[float, float]] = []
    frames = 0
    for k, piece in enumerate(pieces):
        begin = count if k > 0 else 0
        end = piece.poses.frame_count - (count if k + 1 < len(pieces) else 0)
        alone = piece.part(slice(begin, end))
        done.append(alone.poses if alone.feet is None else with_feet_at(alone.poses, alone.feet))
        frames += end - begin
        if k + 1 < len(pieces):
            done.append(blended(piece.part(slice(end, None)), pieces[k + 1].part(slice(count))))
            seams.append((frames / rate, (frames + count) / rate))
            frames += count
    return Spliced(_joined(done, rate), tuple(spans), tuple(seams))


def _rows(poses: Poses, part: Part) -> slice:
    """The frames of a part.

    Raises:
        SettingsError: it has none.
    """
    low = poses.time_s[0] if part.start_s is None else part.start_s
    high = poses.time_s[-1] if part.end_s is None else part.end_s
    first, last = np.searchsorted(poses.time_s, [low - 1e-6, high + 1e-6])
    if last <= first:
        raise SettingsError(
            "splice.outside",
            "{start_s:.2f} to {end_s:.2f} s has no frame; the solve goes from {first_s:.2f} to {last_s:.2f} s",
            start_s=low, end_s=high, first_s=poses.time_s[0], last_s=poses.time_s[-1],
        )  # fmt: skip
    return slice(int(first), int(last))


def _likest(end: Poses, poses: Poses, rows: slice, least: int, near: int) -> int:
    """The start of a part, up to `near` frames from that of `rows`, most similar to the end of the part before; at
    least `least` frames remain."""
    low = max(rows.start - near, 0)
    high = max(min(rows.start + near, rows.stop - least), low)
    count = end.frame_count
    wanted, own = features_of(end), features_of(frames_of(poses, slice(low, high + count)))
    off = [float(((own[k : k + count] - wanted) ** 2).sum()) for k in range(len(own) - count + 1)]
    return low + int(np.argmin(off)) if near else rows.start


def _joined(pieces: Sequence[Poses], rate: float) -> Poses:
    """Return pieces one after the other, from 0 s."""
    first = pieces[0]
    keys = ("positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")
    values = {key: np.concatenate([getattr(piece, key) for piece in pieces]) for key in keys}
    times_s = np.arange(len(values["positions_m"])) / rate
    return Poses(times_s, first.joint_names, first.parents, **values, root_height_m=first.root_height_m)


def _check(whole: Sequence[Poses], rows: Sequence[slice], count: int, rate: float) -> None:
    """Raise SettingsError where parts of solves cannot be spliced by seams of `count` frames."""
    first = whole[0]
    for k, (poses, own) in enumerate(zip(whole, rows, strict=True)):
        frames = own.stop - own.start
        least = ((k > 0) + (k + 1 < len(whole))) * count + LEAST_FRAMES
        if frames < least:
            raise SettingsError(
                "splice.short",
                "part {part} lasts {seconds:.2f} s; with its seams it must last {least:.2f} s: take more of it, or "
                "blend for a shorter time",
                part=k + 1,
                seconds=frames / rate,
                least=least / rate,
            )
        if poses.joint_names != first.joint_names:
            raise SettingsError(
                "splice.joints",
                "part {part} has other joints than part 1; splice solves of one kind",
                part=k + 1,
            )
        size = _bones_m(poses) / max(_bones_m(first), 1e-9)
        if abs(size - 1.0) > OTHER_BODY:
            raise SettingsError(
                "splice.body",
                "part {part} is of another body than part 1: its bones are {share:.0f} % as long; splice takes of "
                "one performer",
                part=k + 1,
                share=100.0 * size,
            )


def _bones_m(poses: Poses) -> float:
    """Length of all bones of a skeleton [m]."""
    below = np.flatnonzero(poses.parents >= 0)
    bones = poses.positions_m[:1, below] - poses.positions_m[:1, poses.parents[below]]
    return float(np.linalg.norm(bones, axis=2).sum())
