"""Data of a clip's timeline: curves of one joint, used cameras, stances, pops."""

from typing import TypeAlias

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from studio.engine.base.errors import SettingsError
from studio.engine.metrics.figures.feet import stance_of
from studio.engine.model.joints import INDEX, OUTPUT_INDEX, OUTPUT_JOINTS, OUTPUT_OF_CANONICAL
from studio.engine.model.spans import Span
from studio.engine.whole_take.trace import Trace
from studio.web.playback.clip import Clip

MAX_POINTS = 4000
_CANONICAL_OF_OUTPUT = {output: name for name, output in OUTPUT_OF_CANONICAL.items()}
_FEET = {"left": ("LeftFoot", "LeftToeBase"), "right": ("RightFoot", "RightToeBase")}


FrameSpan: TypeAlias = tuple[int, int]
"""First and last frame."""


class Curves(Struct):
    """Curves of an output joint, thinned to frames that keep every curve's extremes.

    Spans that are closer than a thinned frame are merged.

    Attributes:
        frame: indices; start_s: stage time at which the performance begins [s]; time_s: since then [s].
        position_m: by axis `x`, `y`, `z`.
        uncertainty_mm: -1 where unknown.
        cameras: by name the spans in which the camera saw the joint but was not used for it, with the reason.
        used: by name the spans in which it was used.
        stance: by side the spans in which a foot stands.
        pops: the spans in which the joint is over 5 cm off its path, as the edit list's `joint_pop`
            (`metrics.cleanup.pops`), at the solve's own frames.
        away: the spans in which the performer is not on the stage.
        undecided: by performer the spans in which they were not told apart from another.
        disagrees: by camera the spans in which it disagreed, with its joints' distance from the other cameras' [mm].
    """

    joint: str
    frame: list[int]
    start_s: float
    time_s: list[float]
    position_m: dict[str, list[float]]
    speed_m_s: list[float]
    confidence: list[float]
    uncertainty_mm: list[float]
    cameras: dict[str, list[tuple[int, int, str]]]
    used: dict[str, list[FrameSpan]]
    stance: dict[str, list[FrameSpan]]
    pops: list[FrameSpan]
    away: list[FrameSpan]
    undecided: dict[str, list[FrameSpan]]
    disagrees: dict[str, list[tuple[int, int, int]]]


def curves(clip: Clip, joint: str, points: int = MAX_POINTS) -> Curves:
    """Return the curves of an output joint, thinned to about `points` frames.

    Raises:
        SettingsError: no such joint.
    """
    if joint not in OUTPUT_INDEX:
        raise no_joint(joint)
    poses, row = clip.poses, OUTPUT_INDEX[joint]
    count = poses.frame_count
    positions = poses.positions_m[:, row]
    speed = speed_m_s(positions, poses.time_s)
    confidence = np.nan_to_num(poses.confidence[:, row])
    uncertainty = np.nan_to_num(poses.uncertainty_mm[:, row], nan=-1.0)
    frames = thinned(np.column_stack([positions, speed, confidence, uncertainty]), points)
    gap = count // points
    times = poses.time_s - poses.begins_s
    return Curves(
        joint=joint,
        frame=frames.tolist(),
        start_s=poses.begins_s,
        time_s=times[frames].round(4).tolist(),
        position_m={axis: positions[frames, k].round(4).tolist() for k, axis in enumerate("xyz")},
        speed_m_s=speed[frames].round(3).tolist(),
        confidence=confidence[frames].round(3).tolist(),
        uncertainty_mm=uncertainty[frames].round(1).tolist(),
        cameras=_unused(clip, joint, gap),
        used=_used(clip, joint, gap),
        stance=_stance(clip, gap),
        pops=_pops(clip, row, gap),
        away=[] if clip.here is None else spans(~clip.here, gap),
        undecided={clip.names[one]: _frames_of(clip, times) for one, times in clip.undecided_s.items()},
        disagrees={name: _disagreeing(clip, spans) for name, spans in clip.disagrees.items()},
    )


def _frames_of(clip: Clip, times_s: tuple[tuple[float, float], ...]) -> list[FrameSpan]:
    """Return spans of stage time [s] as first and last frame."""
    return [(clip.nearest(begin), clip.nearest(end)) for begin, end in times_s]


def _disagreeing(clip: Clip, spans: list[Span]) -> list[tuple[int, int, int]]:
    """Return a camera's disagreeing spans as first and last frame, and the distance [mm]."""
    out = []
    for span in spans:
        inside = np.flatnonzero(span.contains(clip.poses.time_s))
        if len(inside):
            out.append((int(inside[0]), int(inside[-1]), round(span.metres * 1e3)))
    return out


def speed_m_s(positions_m: NDArray[np.float64], time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the speed of a joint along its places, shape (frame_count, 3), at increasing times."""
    if len(time_s) < 2:
        return np.zeros(len(time_s))
    speed: NDArray[np.float64] = np.linalg.norm(np.gradient(positions_m, time_s, axis=0), axis=1)
    return speed


def thinned(values: NDArray[np.float64], points: int) -> NDArray[np.int64]:
    """Return about `points` frames for curves: of each stretch, the first frame and each curve's extremes.

    Args:
        values: a column per curve, shape (frame_count, curve_count).
        points: all frames if there are no more.
    """
    count, curve_count = values.shape
    if count <= points:
        return np.arange(count)
    size = -(-count * (2 * curve_count + 1) // points)
    bins = -(-count // size)
    padded = np.pad(values, ((0, bins * size - count), (0, 0)), mode="edge").reshape(bins, size, curve_count)
    starts = np.arange(bins)[:, None] * size
    found = np.column_stack([starts, padded.argmin(axis=1) + starts, padded.argmax(axis=1) + starts])
    return np.unique(np.minimum(np.append(found, count - 1), count - 1))


def _unused(clip: Clip, joint: str, gap: int) -> dict[str, list[tuple[int, int, str]]]:
    """Per camera the spans in which it saw the joint and was not used for it, with the reason."""
    name = _CANONICAL_OF_OUTPUT.get(joint)
    if clip.trace is None or name is None:
        return {}
    trace, place = clip.trace, INDEX[name]
    out: dict[str, list[tuple[int, int, str]]] = {}
    for camera, label in enumerate(trace.cameras):
        left_out = seen_by(trace, camera, place) & ~trace.used[:, camera, place]
        reasons = trace.reason[:, camera, place]
        mine: list[tuple[int, int, str]] = []
        for reason in np.unique(reasons[left_out]):
            words = trace.reasons[reason] or "not used"
            mine += [(*span, words) for span in spans(left_out & (reasons == reason), gap)]
        out[label] = sorted(mine)
    return out


def _used(clip: Clip, joint: str, gap: int) -> dict[str, list[FrameSpan]]:
    """Per camera the spans in which it was used for a joint."""
    name = _CANONICAL_OF_OUTPUT.get(joint)
    if clip.trace is None or name is None:
        return {}
    trace, place = clip.trace, INDEX[name]
    return {
        label: spans(seen_by(trace, camera, place) & trace.used[:, camera, place], gap)
        for camera, label in enumerate(trace.cameras)
    }


def seen_by(trace: Trace, camera: int, place: int) -> NDArray[np.bool_]:
    """Return the frames in which a camera saw a canonical joint, both by index, shape (frame_count,)."""
    seen: NDArray[np.bool_] = trace.camera_half_mm[:, camera, place, 0] != np.iinfo(np.int16).min
    return seen


def _stance(clip: Clip, gap: int) -> dict[str, list[FrameSpan]]:
    poses = clip.poses
    if poses.frame_count < 3 or not clip.solve:  # without a solve there are no feet
        return {side: [] for side in _FEET}
    out = {}
    for side, joints in _FEET.items():
        feet = poses.positions_m[:, [OUTPUT_INDEX[joint] for joint in joints]]
        stands = np.any(stance_of(feet, poses.time_s), axis=1)
        out[side] = spans(stands if clip.here is None else stands & clip.here, gap)
    return out


def _pops(clip: Clip, row: int, gap: int) -> list[FrameSpan]:
    """Spans in which a joint pops, merged as in the edit list. Frames with uneven times are resampled to an even
    grid, as in exports.
    """
    from studio.engine.metrics.cleanup.events import JOIN_S  # their imports are not needed at the start
    from studio.engine.metrics.cleanup.pops import POP_CM, off_course_cm

    poses = clip.poses
    step_s = 1.0 / poses.frames_per_second
    even_s = np.arange(poses.begins_s, poses.time_s[-1] + 0.5 * step_s, step_s)
    place = [np.interp(even_s, poses.time_s, axis) for axis in poses.positions_m[:, row].T]
    off_cm = off_course_cm(np.stack(place, axis=1)[:, None], step_s)[:, 0]
    nearest = np.minimum(np.rint((poses.time_s - poses.begins_s) / step_s).astype(int), len(even_s) - 1)
    return spans(off_cm[nearest] > POP_CM, max(gap, round(JOIN_S / step_s)))


def spans(flags: NDArray[np.bool_], gap: int = 0) -> list[FrameSpan]:
    """Return the first and last index of every run of True; runs with no more than `gap` between them are one."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))).reshape(-1, 2)
    if len(edges) and gap:
        apart = edges[1:, 0] - edges[:-1, 1] > gap
        edges = np.column_stack([edges[np.append(True, apart), 0], edges[np.append(apart, True), 1]])
    return [(int(first), int(last) - 1) for first, last in edges]


def no_joint(joint: str) -> SettingsError:
    """Return the error for a joint that no solve has."""
    return SettingsError(
        "replay.no_joint",
        "there is no joint {joint!r}; allowed: {allowed}",
        joint=joint,
        allowed=[*OUTPUT_JOINTS],
    )
