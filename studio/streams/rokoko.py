"""JSON v3 of Rokoko Studio: a UDP datagram per frame, LZ4, for the plugins of Blender, Unity, Unreal, Maya.

World positions and world rotations in Unity's axes. A rotation is that of the bone's own axes, which point along
the bone in the T-pose of that program's actor; `_rest` has those rotations. Source of names and rest rotations: the
program's published plugins for Unity and Blender.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import lz4.frame
import msgspec
import numpy as np
from numpy.typing import NDArray

from studio.engine.base.quaternions import IDENTITY, multiply, normalized, rotate
from studio.engine.model.joints import FINGERS, OUTPUT_INDEX, OUTPUT_JOINTS
from studio.engine.timecode.timecode import Timecode
from studio.streams.unity import UnityPose

PORT = 14043
_COLOURS = ([255, 138, 61], [61, 151, 255], [125, 200, 95], [190, 110, 230])
_META = {"hasGloves": True, "hasLeftGlove": True, "hasRightGlove": True, "hasBody": True, "hasFace": False}

_TRUNK = {"Hips": "hip", "Spine": "spine", "Spine2": "chest", "Neck": "neck", "Head": "head"}
_LIMBS = {
    "Shoulder": "Shoulder", "Arm": "UpperArm", "ForeArm": "LowerArm", "Hand": "Hand",
    "UpLeg": "UpLeg", "Leg": "Leg", "Foot": "Foot", "ToeBase": "Toe",
}  # fmt: skip
_PHALANGES = ("Proximal", "Medial", "Distal")
_TIP_SHARE = 0.8
"""Distance of a fingertip beyond the last joint, as a share of the bone before it; also of a toe's end."""

_HALF = np.sqrt(0.5)
_THUMB = np.array([[0.092, 0.561, 0.701, -0.430], [0.2706, 0.6533, 0.6533, -0.2706]])
_LEFT_REST = {
    "Shoulder": (-_HALF, 0.0, 0.0, _HALF),
    "Arm": (0.5, 0.5, 0.5, -0.5),
    "UpLeg": (_HALF, 0.0, _HALF, 0.0),
    "Foot": (0.0, 0.0, _HALF, -_HALF),
}


def _left_rest(part: str) -> NDArray[np.float64]:
    """Rest rotation wxyz of a joint of the left side, by its name without the side."""
    if part.startswith("HandThumb"):
        return normalized(_THUMB[0 if part.endswith("1") else 1])
    families = {"Shoulder": "Shoulder", "UpLeg": "UpLeg", "Leg": "UpLeg", "Foot": "Foot", "ToeBase": "Foot"}
    return np.array(_LEFT_REST[families.get(part, "Arm")])


def _rest(joint: str) -> NDArray[np.float64]:
    """Rest rotation wxyz of an output joint; the right side mirrors the left."""
    if joint == "Hips":
        return IDENTITY
    if joint.startswith("Left"):
        return _left_rest(joint.removeprefix("Left"))
    if joint.startswith("Right"):
        return _left_rest(joint.removeprefix("Right")) * (1.0, 1.0, -1.0, -1.0)
    return np.array([0.0, 0.0, 0.0, 1.0])


_REST = np.array([_rest(joint) for joint in OUTPUT_JOINTS])


def _names() -> dict[str, str]:
    names = dict(_TRUNK)
    for side in ("Left", "Right"):
        names |= {side + joint: side.lower() + name for joint, name in _LIMBS.items()}
        for finger in FINGERS:
            label = {"Pinky": "Little"}.get(finger, finger)
            for number, phalanx in enumerate(_PHALANGES, start=1):
                names[f"{side}Hand{finger}{number}"] = f"{side.lower()}{label}{phalanx}"
    return names


_NAMES = _names()
_JOINTS = np.array([OUTPUT_INDEX[joint] for joint in _NAMES])
_LEAVES = [joint for joint in _NAMES if joint.endswith("3") or joint.endswith("ToeBase")]
_ENDS = np.array([OUTPUT_INDEX[joint] for joint in _LEAVES])
_END_NAMES = [
    _NAMES[joint].removesuffix("Distal") + ("End" if joint.endswith("ToeBase") else "Tip")
    for joint in _LEAVES
]
_BODY_NAMES = [*_NAMES.values(), *_END_NAMES]


@dataclass(frozen=True)
class RokokoActor:
    """One performer of a frame.

    Attributes:
        name: name of the actor.
        pose: the frame.
        height_m: height of the performer; hip_height_m: height of the hips above the floor in the T-pose.
    """

    name: str
    pose: UnityPose
    height_m: float
    hip_height_m: float

    def to_json(self, place: int) -> dict[str, Any]:
        """Return the actor in the format; `place` is its index among the actors, which gives the colour."""
        pose = self.pose
        rotations = multiply(pose.rotations_wxyz, _REST)
        offsets = pose.local_positions_m[_ENDS] * _TIP_SHARE
        ends = pose.positions_m[_ENDS] + rotate(pose.rotations_wxyz[_ENDS], offsets)
        positions = np.concatenate([pose.positions_m[_JOINTS], ends]).round(5).tolist()
        turned = np.concatenate([rotations[_JOINTS], rotations[_ENDS]]).round(6).tolist()
        body = {
            name: {
                "position": {"x": p[0], "y": p[1], "z": p[2]},
                "rotation": {"x": q[1], "y": q[2], "z": q[3], "w": q[0]},
            }
            for name, p, q in zip(_BODY_NAMES, positions, turned, strict=True)
        }
        return {
            "name": self.name,
            "color": _COLOURS[place % len(_COLOURS)],
            "meta": _META,
            "dimensions": {"totalHeight": round(self.height_m, 4), "hipHeight": round(self.hip_height_m, 4)},
            "body": body,
        }


class RokokoEncoder:
    """Makes the datagram of a frame.

    Args:
        fps: frame rate stated to the receiver [Hz].
    """

    def __init__(self, fps: float) -> None:
        self._fps = fps

    def encode(self, actors: Sequence[RokokoActor], timecode: Timecode | None = None) -> list[bytes]:
        """Return the datagram of a frame of at least one actor; `timecode` is in fields that plugins ignore."""
        scene: dict[str, Any] = {
            "timestamp": actors[0].pose.time_s,
            "actors": [actor.to_json(place) for place, actor in enumerate(actors)],
            "characters": [],
            "props": [],
        }
        if timecode is not None:
            scene |= {"timecode": str(timecode), "timecodeRate": timecode.rate.name}
        return [lz4.frame.compress(msgspec.json.encode({"version": "3.0", "fps": self._fps, "scene": scene}))]
