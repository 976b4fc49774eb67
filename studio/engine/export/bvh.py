"""BVH: text, centimetres, y up, channels in the order ZXY, a T-pose of zero rotations, End Sites.

Position channels replace a joint's OFFSET, as MotionBuilder and Blender read them. The root's OFFSET is zero,
because readers disagree on whether it adds to the root's position channels.
"""

import os
from typing import IO

import numpy as np
from numpy.typing import NDArray

from studio.engine.export.euler import euler_deg
from studio.engine.export.skeleton import LocalMotion, end_sites, local_motion
from studio.engine.files import write_atomically
from studio.engine.poses import Poses

_ROTATIONS = "Zrotation Xrotation Yrotation"
_FRAMES_AT_ONCE = 1024


def write_bvh(poses: Poses, path: str | os.PathLike[str], *, fps: float | None = None) -> None:
    """Write the poses as a BVH file, atomically.

    Args:
        poses: of any skeleton with one root; spaces in joint names become underscores.
        path: of the file; an existing one is replaced.
        fps: frame rate [Hz]; None keeps that of the poses.

    Raises:
        FormatError: poses that cannot be exported.
        SettingsError: fps out of range.
        StudioError: the file cannot be written.
    """
    motion = local_motion(poses, fps=fps)
    columns = _columns(motion)
    with write_atomically(path) as file:
        file.write("\n".join(_hierarchy(motion)).encode())
        header = f"\nMOTION\nFrames: {motion.frame_count}\nFrame Time: {1 / motion.frames_per_second:.9f}\n"
        file.write(header.encode())
        _write_rows(file, columns)


def _hierarchy(motion: LocalMotion) -> list[str]:
    children: list[list[int]] = [[] for _ in motion.parents]
    for joint, parent in enumerate(motion.parents):
        if parent >= 0:
            children[parent].append(joint)
    ends = end_sites(motion)
    lines = ["HIERARCHY"]

    def add(joint: int, indent: str) -> None:
        root = motion.parents[joint] < 0
        name = "_".join(motion.joint_names[joint].split())
        lines.append(f"{indent}{'ROOT' if root else 'JOINT'} {name}")
        lines.append(indent + "{")
        inner = indent + "\t"
        lines.append(inner + _offset(np.zeros(3) if root else motion.offsets_m[joint]))
        if joint in motion.positions_m:
            lines.append(f"{inner}CHANNELS 6 Xposition Yposition Zposition {_ROTATIONS}")
        else:
            lines.append(f"{inner}CHANNELS 3 {_ROTATIONS}")
        for child in children[joint]:
            add(child, inner)
        if joint in ends:
            lines.extend([f"{inner}End Site", inner + "{", f"{inner}\t{_offset(ends[joint])}", inner + "}"])
        lines.append(indent + "}")

    add(0, "")
    return lines


def _offset(offset_m: NDArray[np.float64]) -> str:
    x, y, z = offset_m * 100.0 + 0.0  # adding zero turns -0 into 0
    return f"OFFSET {x:.6f} {y:.6f} {z:.6f}"


def _columns(motion: LocalMotion) -> NDArray[np.float64]:
    """Return every channel [cm and deg] in the order of the hierarchy, shape (frame_count, channel_count).

    The hierarchy is written depth first, so joints are visited in that order, not in the order of the poses.
    """
    blocks = []
    for joint in _depth_first(motion.parents):
        if joint in motion.positions_m:
            blocks.append(motion.positions_m[joint] * 100.0)
        blocks.append(euler_deg(motion.rotations_wxyz[:, joint], "ZXY")[:, [2, 0, 1]])
    return np.concatenate(blocks, axis=1)


def _depth_first(parents: NDArray[np.int64]) -> list[int]:
    order: list[int] = []
    stack = [0]
    while stack:
        joint = stack.pop()
        order.append(joint)
        stack.extend(reversed(np.flatnonzero(parents == joint).tolist()))
    return order


def _write_rows(file: IO[bytes], columns: NDArray[np.float64]) -> None:
    row = " ".join(["%.5f"] * columns.shape[1]) + "\n"
    for start in range(0, len(columns), _FRAMES_AT_ONCE):
        block = columns[start : start + _FRAMES_AT_ONCE]
        file.write(((row * len(block)) % tuple(block.ravel().tolist())).encode())
