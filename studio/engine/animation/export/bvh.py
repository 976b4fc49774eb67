"""BVH: text, y up, a T-pose of zero rotations, End Sites; centimetres and channels in the order ZXY by default.

Position channels replace a joint's OFFSET, as MotionBuilder and Blender read them. The root's OFFSET is zero,
because readers disagree on whether it adds to the root's position channels. A BVH joint has the axes of the
file in the rest pose, so bones with their own axes lose them.
"""

import os
from typing import IO

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.clip.options import UNITS_M, ExportOptions
from studio.engine.animation.clip.skeleton import LocalMotion, end_sites, with_file_axes
from studio.engine.animation.curves.euler import euler_deg
from studio.engine.base.files import write_atomically

_FRAMES_AT_ONCE = 1024


def write_bvh(motion: LocalMotion, path: str | os.PathLike[str], options: ExportOptions) -> None:
    """Write the motion as a BVH file, atomically.

    Args:
        motion: spaces in joint names become underscores.
        path: of the file; an existing one is replaced.
        options: `rotation_order` and `unit` are used.

    Raises:
        StudioError: the file cannot be written.
    """
    motion = with_file_axes(motion)
    order, scale = options.rotation_order, 1.0 / UNITS_M[options.unit]
    columns = _columns(motion, order, scale)
    with write_atomically(path) as file:
        file.write("\n".join(_hierarchy(motion, order, scale)).encode())
        header = f"\nMOTION\nFrames: {motion.frame_count}\nFrame Time: {1 / motion.frames_per_second:.9f}\n"
        file.write(header.encode())
        _write_rows(file, columns, digits=5 + max(0, round(2 - np.log10(scale))))


def _hierarchy(motion: LocalMotion, order: str, scale: float) -> list[str]:
    children: list[list[int]] = [[] for _ in motion.parents]
    for joint, parent in enumerate(motion.parents):
        if parent >= 0:
            children[parent].append(joint)
    ends = end_sites(motion)
    turns = " ".join(f"{axis}rotation" for axis in order)
    lines = ["HIERARCHY" + _comment(motion)]

    def add(joint: int, indent: str) -> None:
        root = motion.parents[joint] < 0
        name = "_".join(motion.joint_names[joint].split())
        lines.append(f"{indent}{'ROOT' if root else 'JOINT'} {name}")
        lines.append(indent + "{")
        inner = indent + "\t"
        lines.append(inner + _offset(np.zeros(3) if root else motion.offsets_m[joint], scale))
        if joint in motion.positions_m or root:
            lines.append(f"{inner}CHANNELS 6 Xposition Yposition Zposition {turns}")
        else:
            lines.append(f"{inner}CHANNELS 3 {turns}")
        for child in children[joint]:
            add(child, inner)
        if joint in ends:
            end = _offset(ends[joint], scale)
            lines.extend([f"{inner}End Site", inner + "{", f"{inner}\t{end}", inner + "}"])
        lines.append(indent + "}")

    add(0, "")
    return lines


def _comment(motion: LocalMotion) -> str:
    """Return the timecode of the first frame, for the first line, of which readers read the first word only."""
    return "" if motion.timecode is None else f" # timecode {motion.timecode} {motion.timecode.rate.name}"


def _offset(offset_m: NDArray[np.float64], scale: float) -> str:
    x, y, z = offset_m * scale + 0.0  # adding zero turns -0 into 0
    return f"OFFSET {x:.6f} {y:.6f} {z:.6f}"


def _columns(motion: LocalMotion, order: str, scale: float) -> NDArray[np.float64]:
    """Return every channel [unit and deg] in the order of the hierarchy, shape (frame_count, channel_count).

    The hierarchy is written depth first, so joints are visited in that order instead of the order of the motion.
    """
    axes = ["XYZ".index(axis) for axis in order]
    blocks = []
    for joint in _depth_first(motion.parents):
        if joint in motion.positions_m:
            blocks.append(motion.positions_m[joint] * scale)
        elif motion.parents[joint] < 0:
            blocks.append(np.tile(motion.offsets_m[joint] * scale, (motion.frame_count, 1)))
        blocks.append(euler_deg(motion.rotations_wxyz[:, joint], order)[:, axes])
    return np.concatenate(blocks, axis=1)


def _depth_first(parents: NDArray[np.int64]) -> list[int]:
    order: list[int] = []
    stack = [0]
    while stack:
        joint = stack.pop()
        order.append(joint)
        stack.extend(reversed(np.flatnonzero(parents == joint).tolist()))
    return order


def _write_rows(file: IO[bytes], columns: NDArray[np.float64], *, digits: int) -> None:
    row = " ".join([f"%.{digits}f"] * columns.shape[1]) + "\n"
    for start in range(0, len(columns), _FRAMES_AT_ONCE):
        block = columns[start : start + _FRAMES_AT_ONCE]
        file.write(((row * len(block)) % tuple(block.ravel().tolist())).encode())
