"""What the timeline draws of a clip: curves of one joint, which cameras were used, when feet stand, spikes."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.engine.errors import SettingsError
from studio.engine.joints import INDEX, OUTPUT_INDEX, OUTPUT_JOINTS, OUTPUT_OF_CANONICAL
from studio.engine.metrics.feet import stance_of
from studio.web.playback.clip import Clip

MAX_POINTS = 2000
_CANONICAL_OF_OUTPUT = {output: name for name, output in OUTPUT_OF_CANONICAL.items()}
_FEET = {"left": ("LeftFoot", "LeftToeBase"), "right": ("RightFoot", "RightToeBase")}


def curves(clip: Clip, joint: str, points: int = MAX_POINTS) -> dict[str, Any]:
    """Return the curves of an output joint, thinned to `points` frames.

    Returns:
        `frame` (indices), `time_s`, `position_m` (`x`, `y`, `z`), `speed_m_s`, `confidence`, `uncertainty_mm`;
        `cameras`, by name a list of spans `[first, last, reason]` in which the camera's joint was not used although
        the camera saw it; `stance`, by side a list of spans `[first, last]` of frames.

    Raises:
        SettingsError: no such joint.
    """
    if joint not in OUTPUT_INDEX:
        raise SettingsError(f"there is no joint {joint!r}; allowed: {', '.join(OUTPUT_JOINTS)}")
    poses, row = clip.poses, OUTPUT_INDEX[joint]
    count = poses.frame_count
    frames = np.unique(np.linspace(0, count - 1, min(count, points)).round().astype(int))
    positions = poses.positions_m[:, row]
    speed = np.zeros(count)
    if count > 1:
        speed = np.linalg.norm(np.gradient(positions, poses.time_s, axis=0), axis=1)
    times = poses.time_s - poses.time_s[0]
    return {
        "joint": joint,
        "frame": frames.tolist(),
        "time_s": times[frames].round(4).tolist(),
        "position_m": {axis: positions[frames, k].round(4).tolist() for k, axis in enumerate("xyz")},
        "speed_m_s": speed[frames].round(3).tolist(),
        "confidence": np.nan_to_num(poses.confidence[frames, row]).round(3).tolist(),
        "uncertainty_mm": np.nan_to_num(poses.uncertainty_mm[frames, row], nan=-1.0).round(1).tolist(),
        "cameras": _unused(clip, joint),
        "stance": _stance(clip),
    }


def _unused(clip: Clip, joint: str) -> dict[str, list[list[Any]]]:
    """Per camera the spans in which it saw the joint and was not used for it, with the reason."""
    name = _CANONICAL_OF_OUTPUT.get(joint)
    if clip.trace is None or name is None:
        return {}
    trace, place = clip.trace, INDEX[name]
    out = {}
    for camera, label in enumerate(trace.cameras):
        seen = trace.camera_half_mm[:, camera, place, 0] != np.iinfo(np.int16).min
        left_out = seen & ~trace.used[:, camera, place]
        reasons = trace.reason[:, camera, place]
        out[label] = [
            [first, last, trace.reasons[reasons[first]] or "not used"] for first, last in spans(left_out)
        ]
    return out


def _stance(clip: Clip) -> dict[str, list[list[int]]]:
    poses = clip.poses
    if poses.frame_count < 3:
        return {side: [] for side in _FEET}
    out = {}
    for side, joints in _FEET.items():
        feet = poses.positions_m[:, [OUTPUT_INDEX[joint] for joint in joints]]
        out[side] = [list(span) for span in spans(stance_of(feet, poses.time_s).any(axis=1))]
    return out


def spans(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the first and last index of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(first), int(last) - 1) for first, last in edges.reshape(-1, 2)]
