"""Messages of the WebSocket stream: a head with the skeleton, then one JSON text per frame, in the stage frame.

Metres, z up, quaternions wxyz, the identity in the T-pose; the same values as in `poses.npz`.
"""

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from studio.engine.model.frames import StepResult
from studio.engine.model.joints import OUTPUT_JOINTS, OUTPUT_PARENTS
from studio.streams.cast import Member

FORMAT_VERSION = 1


def head_message() -> str:
    """Return the first message, which describes the frames."""
    head = {
        "type": "skeleton",
        "format_version": FORMAT_VERSION,
        "joint_names": list(OUTPUT_JOINTS),
        "parents": OUTPUT_PARENTS.tolist(),
        "axes": "z up, facing -y in the T-pose, right-handed",
        "unit": "m",
    }
    return msgspec.json.encode(head).decode()


def frame_message(steps: Sequence[tuple[StepResult, Member]]) -> str:
    """Return the message of a frame of at least one performer: time [s], positions (52, 3), rotations (52, 4),
    confidence (52). A performer among several has the key `performer`; further ones are in `others`.
    With incoming timecode, `timecode` and `timecode_rate` are those of the frame.
    """
    (first, _), *others = steps
    frame = {"type": "frame", "time_s": first.frame_set.stage_time_ns * 1e-9, **_pose(*steps[0])}
    if first.timecode is not None:
        frame["timecode"], frame["timecode_rate"] = str(first.timecode), first.timecode.rate.name
    if others:
        frame["others"] = [_pose(*one) for one in others]
    return msgspec.json.encode(frame).decode()


def _pose(result: StepResult, member: Member) -> dict[str, Any]:
    pose = {
        "positions_m": result.positions_m.round(5).tolist(),
        "rotations_wxyz": result.rotations_wxyz.round(6).tolist(),
        "confidence": np.nan_to_num(result.confidence).round(3).tolist(),
    }
    return pose if member.name == "" else {"performer": member.name, **pose}
