"""Reader of BVH files: the skeleton, and forward kinematics over all frames at once."""

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.motion import END, Motion
from studio.engine.base.errors import FormatError
from studio.engine.base.file_sentences import too_large
from studio.engine.base.sentences import say, system_says

_AXES = {"X": 0, "Y": 1, "Z": 2}
_CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in _AXES)
_HEIGHT_M = 1.75
_MAX_BYTES = 1 << 30
_LARGEST = 1e9  # beyond any length or angle of a BVH; NaN fails the comparison
# stage (x, y, z) = file (x, -z, y)
_STAGE_FILE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass
class _Joint:
    name: str
    parent: int
    offset: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    channels: list[str] = field(default_factory=list)
    has_offset: bool = False


class _Lines:
    """The file's lines that are not blank, with line numbers for messages."""

    def __init__(self, path: Path, text: str) -> None:
        self.path = path
        self.lines = [(n, line.split()) for n, line in enumerate(text.splitlines(), 1) if line.strip()]
        self.next = 0

    def take(self, expected: str) -> list[str]:
        if self.next == len(self.lines):
            last = self.lines[-1][0] if self.lines else 0
            raise FormatError(
                "bvh.cut_off_expecting",
                "{path} is cut off after line {line}: expected {expected}; export or copy it again",
                path=self.path,
                line=last,
                expected=expected,
            )
        self.next += 1
        return self.lines[self.next - 1][1]

    def fail(self, what: str) -> FormatError:
        number = self.lines[max(self.next - 1, 0)][0] if self.lines else 0
        return FormatError(
            "bvh.line",
            "{path}, line {line}: {error}; export or copy the file again",
            path=self.path,
            line=number,
            error=what,
        )

    def numbers(self, words: list[str], count: int, what: str) -> list[float]:
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) != count or not all(abs(value) < _LARGEST for value in values):
            raise self.fail(
                say(
                    "bvh.numbers",
                    "{what} needs {n} finite numbers, got {text!r}",
                    what=what,
                    n=count,
                    text=" ".join(words)[:60],
                )
            )
        return values


def read_bvh(path: str | os.PathLike[str], *, unit_m: float | None = None) -> Motion:
    """Return the motion in a BVH file (y up), in the stage frame.

    Args:
        path: the file.
        unit_m: metres per unit of the file; None chooses it so that the rest pose is 1.75 m high.

    Raises:
        FormatError: the file is missing, not a BVH, truncated, or holds a wrong number of values or a value
            that is not a finite number; or `unit_m` is not positive.
    """
    path = Path(path)
    if unit_m is not None and not (np.isfinite(unit_m) and unit_m > 0):
        raise FormatError(
            "bvh.unit",
            "unit of {m} m; a BVH's unit must be a positive number of metres, such as 0.01",
            m=unit_m,
        )
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise FormatError(too_large(path, _MAX_BYTES))
        text = path.read_bytes().decode("utf-8", errors="replace").lstrip("\ufeff")
    except OSError as error:
        raise FormatError(
            "bvh.unreadable",
            "cannot read {path}: {error}; give a BVH file",
            path=path,
            error=system_says(error),
        ) from error
    if not text.lstrip().upper().startswith("HIERARCHY"):
        raise FormatError(
            "bvh.not_bvh",
            "{path} is not a BVH file: it does not begin with HIERARCHY; give a BVH file",
            path=path,
        )
    lines = _Lines(path, text)
    joints = _read_hierarchy(lines)
    frame_s, values = _read_frames(lines, sum(len(joint.channels) for joint in joints))
    rest = _rest(joints)
    unit = _HEIGHT_M / _height(lines, joints, rest) if unit_m is None else unit_m
    positions, rotations = _forward(joints, values)
    return Motion(
        frame_s=frame_s,
        joint_names=tuple(joint.name for joint in joints),
        parents=np.array([joint.parent for joint in joints], dtype=np.int64),
        positions_m=positions @ _STAGE_FILE.T * unit,
        rotations=_STAGE_FILE @ rotations @ _STAGE_FILE.T,
        rest_m=rest @ _STAGE_FILE.T * unit,
    )


def _read_hierarchy(lines: _Lines) -> list[_Joint]:
    lines.take("HIERARCHY")
    joints: list[_Joint] = []
    stack: list[int] = []
    while not joints or stack:
        words = lines.take("ROOT, JOINT, End Site, OFFSET, CHANNELS or }")
        key = words[0].upper()
        if key in ("ROOT", "JOINT", "END"):
            _open_joint(lines, joints, stack, words)
        elif key == "}" and stack:
            if not joints[stack[-1]].has_offset:
                raise lines.fail(
                    say("bvh.no_offset", "joint {name} has no OFFSET", name=joints[stack[-1]].name)
                )
            stack.pop()
        elif key == "OFFSET" and stack:
            joints[stack[-1]].offset = lines.numbers(words[1:], 3, "OFFSET")
            joints[stack[-1]].has_offset = True
        elif key == "CHANNELS" and stack and not joints[stack[-1]].name.endswith(END):
            joints[stack[-1]].channels = _read_channels(lines, words)
        else:
            raise lines.fail(say("bvh.not_here", "{text!r} is not allowed here", text=" ".join(words)[:60]))
    return joints


def _open_joint(lines: _Lines, joints: list[_Joint], stack: list[int], words: list[str]) -> None:
    root = words[0].upper() == "ROOT"
    if root == bool(stack) or (root and joints):
        raise lines.fail(say("bvh.one_root", "a BVH needs exactly one ROOT, and every JOINT inside it"))
    if words[-1] == "{" and len(words) > 1:
        words = words[:-1]
    elif lines.take("{") != ["{"]:
        raise lines.fail(say("bvh.brace", "expected {{ after the name of a joint"))
    parent = stack[-1] if stack else -1
    if words[0].upper() == "END":
        name = joints[parent].name + END
    else:
        name = " ".join(words[1:])
        if not name or name in {joint.name for joint in joints}:
            raise lines.fail(say("bvh.joint_name", "joint name {name!r} is empty or used twice", name=name))
    joints.append(_Joint(name, parent))
    stack.append(len(joints) - 1)


def _read_channels(lines: _Lines, words: list[str]) -> list[str]:
    names = [word[:1].upper() + word[1:].lower() for word in words[2:]]
    if len(words) < 2 or words[1] != str(len(names)) or len(set(names)) != len(names):
        raise lines.fail(say("bvh.channels", "CHANNELS needs a count and as many different channel names"))
    for name in names:
        if name not in _CHANNELS:
            raise lines.fail(
                say("bvh.channel", "unknown channel {name!r}; known: {known}", name=name, known=[*_CHANNELS])
            )
    return names


def _read_frames(lines: _Lines, channel_count: int) -> tuple[float, NDArray[np.float64]]:
    """Frame time [s], and channel values, shape (frame_count, channel_count)."""
    if lines.take("MOTION")[0].upper() != "MOTION":
        raise lines.fail(say("bvh.motion", "expected MOTION after the hierarchy"))
    words = lines.take("Frames: N")
    if words[0].lower() != "frames:" or len(words) != 2 or not words[1].isdecimal() or int(words[1]) < 1:
        raise lines.fail(say("bvh.frames_line", "expected `Frames:` and a positive whole number"))
    frames = int(words[1])
    words = lines.take("Frame Time: S")
    if [word.lower() for word in words[:2]] != ["frame", "time:"]:
        raise lines.fail(say("bvh.frame_time_line", "expected `Frame Time:` and the seconds between frames"))
    (frame_s,) = lines.numbers(words[2:], 1, "Frame Time")
    if not 1e-4 <= frame_s <= 10:
        raise lines.fail(
            say("bvh.frame_time", "a frame time of {seconds:g} s; allowed: 0.0001 to 10", seconds=frame_s)
        )
    rows = lines.lines[lines.next :]
    if len(rows) > frames:
        raise FormatError(
            "bvh.more_rows",
            "{path}, line {line}: more rows than the {n} frames announced; export the file again",
            path=lines.path,
            line=rows[frames][0],
            n=frames,
        )
    if len(rows) < frames:
        raise FormatError(
            "bvh.cut_off",
            "{path} is cut off: {n} of {all} frames, up to line {line}; export or copy the file again",
            path=lines.path,
            n=len(rows),
            all=frames,
            line=lines.lines[-1][0],
        )
    values = np.empty((len(rows), channel_count))
    for row in range(len(rows)):
        values[row] = lines.numbers(lines.take("a frame"), channel_count, f"frame {row}")
    return frame_s, values


def _rest(joints: list[_Joint]) -> NDArray[np.float64]:
    rest = np.zeros((len(joints), 3))
    for i, joint in enumerate(joints):
        rest[i] = joint.offset if joint.parent < 0 else rest[joint.parent] + joint.offset
    return rest


def _height(lines: _Lines, joints: list[_Joint], rest: NDArray[np.float64]) -> float:
    """Height of the rest pose in the file's unit: lowest point to the top of the head (or of all)."""
    head = {i for i, joint in enumerate(joints) if joint.name.lower().endswith("head")}
    for i, joint in enumerate(joints):
        if joint.parent in head:
            head.add(i)
    top = rest[sorted(head), 1].max() if head else rest[:, 1].max()
    height = float(top - rest[:, 1].min())
    if height <= 0:
        raise FormatError(
            "bvh.unit_unknown",
            "{path}: the rest pose has no height along y, so the file's unit cannot be guessed; "
            "export it with y up, or give the unit",
            path=lines.path,
        )
    return height


def _forward(
    joints: list[_Joint], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """World positions, shape (F, J, 3), and world rotations, shape (F, J, 3, 3), in the file's axes and unit.

    A position channel replaces that component of the offset.
    """
    frames = len(values)
    positions = np.empty((frames, len(joints), 3))
    rotations = np.empty((frames, len(joints), 3, 3))
    column = 0
    for i, joint in enumerate(joints):
        local = np.tile(np.array(joint.offset), (frames, 1))
        rotation = np.broadcast_to(np.eye(3), (frames, 3, 3))
        for channel in joint.channels:
            axis = _AXES[channel[0]]
            if channel.endswith("position"):
                local[:, axis] = values[:, column]
            else:
                rotation = rotation @ _about(axis, np.radians(values[:, column]))
            column += 1
        if joint.parent < 0:
            positions[:, i], rotations[:, i] = local, rotation
        else:
            parent = rotations[:, joint.parent]
            positions[:, i] = positions[:, joint.parent] + np.einsum("fij,fj->fi", parent, local)
            rotations[:, i] = parent @ rotation
    return positions, rotations


def _about(axis: int, angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrices about one axis, shape (F, 3, 3)."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    out = np.zeros((len(angle), 3, 3))
    out[:, axis, axis] = 1.0
    out[:, a, a] = out[:, b, b] = np.cos(angle)
    out[:, b, a] = np.sin(angle)
    out[:, a, b] = -out[:, b, a]
    return out
