"""A solve's result: the poses of the output skeleton over a take (`poses.npz`)."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from studio.engine.base.arrays import pieces, read_arrays, save_arrays
from studio.engine.base.errors import FormatError
from studio.engine.base.files import write_atomically
from studio.engine.base.versions import POSES
from studio.engine.model.joints import OUTPUT_JOINTS, OUTPUT_PARENTS

_KEYS = ("time_s", "joint_names", "parents", "positions_m", "rotations_wxyz", "confidence", "uncertainty_mm")
_ROOT_HEIGHT = "root_height_m"


@dataclass(frozen=True)
class Poses:
    """Poses of a skeleton over time, in the stage frame (metres, z up, T-pose faces -y).

    A joint's rotation takes the stage axes to the joint's axes. It is the identity in the T-pose, in which
    the left hand points along +x and the toes along -y.

    Attributes:
        time_s: stage time of each frame [s], shape (frame_count,), increasing.
        joint_names: HumanIK names for a solve, shape (joint_count,).
        parents: index of each joint's parent, -1 for the root; parents come before children.
        positions_m: joint positions, shape (frame_count, joint_count, 3).
        rotations_wxyz: unit quaternions of the joints' world rotations, shape (frame_count, joint_count, 4).
        confidence: 0..1, shape (frame_count, joint_count).
        uncertainty_mm: radius of the 90 % ball, shape (frame_count, joint_count); NaN = not measured.
        root_height_m: height of the root over the floor in the T-pose with the soles on the floor; None = unknown.
    """

    time_s: NDArray[np.float64]
    joint_names: tuple[str, ...]
    parents: NDArray[np.int64]
    positions_m: NDArray[np.float64]
    rotations_wxyz: NDArray[np.float64]
    confidence: NDArray[np.float64]
    uncertainty_mm: NDArray[np.float64]
    root_height_m: float | None = None

    def __post_init__(self) -> None:
        frames, joints = len(self.time_s), len(self.joint_names)
        expected = {
            "parents": (joints,),
            "positions_m": (frames, joints, 3),
            "rotations_wxyz": (frames, joints, 4),
            "confidence": (frames, joints),
            "uncertainty_mm": (frames, joints),
        }
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                raise FormatError(
                    "poses.shape",
                    "poses: {name} has shape {shape}, expected {wanted}",
                    name=name,
                    shape=getattr(self, name).shape,
                    wanted=shape,
                )
        numbers = (piece for array in (self.positions_m, self.rotations_wxyz) for piece in pieces(array))
        if not all(np.isfinite(piece).all() for piece in numbers):
            raise FormatError("poses.not_finite", "poses: positions and rotations must be finite")
        if not (self.parents < np.arange(joints)).all():
            raise FormatError("poses.parents", "poses: every parent must come before its child")

    @property
    def frame_count(self) -> int:
        return len(self.time_s)

    @property
    def frames_per_second(self) -> float:
        """Median frame rate [Hz]; 60 where there are fewer than two frames."""
        return 60.0 if self.frame_count < 2 else float(1.0 / np.median(np.diff(self.time_s)))

    @property
    def begins_s(self) -> float:
        """Stage time of the first frame [s]: zero of the clock shown to users.

        A solve leaves out the calibration part of its take, so the performance begins here. Files and `evaluate
        --json` have stage times; replay, reports, pictures and lists show `stage time - begins_s`.
        """
        return float(self.time_s[0])

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        to_disk: bool = True,
        undecided: NDArray[np.bool_] | None = None,
        timecode: Sequence[object] | None = None,
    ) -> None:
        """Write `poses.npz` atomically.

        `to_disk`: see `files.write_atomically`. `undecided`: frames in which the performer was not told apart from
        another, shape (frame_count,), as a further field; None = without it. `timecode`: of each frame, as text.
        """
        with write_atomically(path, to_disk=to_disk) as file:
            arrays: dict[str, ArrayLike] = {key: np.asarray(getattr(self, key)) for key in _KEYS}
            if self.root_height_m is not None:
                arrays[_ROOT_HEIGHT] = np.float64(self.root_height_m)
            if undecided is not None:
                arrays["undecided"] = undecided
            if timecode is not None:
                arrays["timecode"] = np.array([str(one) for one in timecode])
            save_arrays(file, arrays, POSES)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Poses":
        """Return the poses in the file.

        Raises:
            FormatError: the file is missing, damaged, or lacks a key.
        """
        if not Path(path).is_file():
            raise FormatError("poses.none", "no poses at {path}; run `studio solve` first", path=path)
        try:
            values = read_arrays(path, _KEYS, POSES, optional=(_ROOT_HEIGHT,))
        except (KeyError, ValueError, OSError, EOFError) as error:
            raise FormatError(
                "poses.not_npz",
                "{path} is not a poses.npz: {error}; solve the take again",
                path=path,
                error=error,
            ) from error
        except FormatError:
            raise
        except Exception as error:  # zipfile and zlib raise their own errors for a truncated file
            raise FormatError(
                "poses.damaged", "{path} is damaged: {error}; solve the take again", path=path, error=error
            ) from error
        fields: dict[str, Any] = {**values, "joint_names": tuple(str(name) for name in values["joint_names"])}
        if _ROOT_HEIGHT in values:
            fields[_ROOT_HEIGHT] = float(values[_ROOT_HEIGHT])
        return cls(**fields)


def on_output_joints(poses: Poses) -> Poses:
    """Return a solve with all output joints. A missing joint, as in imported animations, is carried by its parent.

    Raises:
        FormatError: the hips are missing.
    """
    if poses.joint_names == OUTPUT_JOINTS:
        return poses
    own = {name: index for index, name in enumerate(poses.joint_names)}
    if "Hips" not in own:
        raise FormatError("poses.no_hips", "an animation has no hips: it cannot be put on a character")
    nearest: list[int] = []
    for name, parent in zip(OUTPUT_JOINTS, OUTPUT_PARENTS, strict=True):
        nearest.append(own[name] if name in own else nearest[parent])
    return Poses(
        poses.time_s,
        OUTPUT_JOINTS,
        OUTPUT_PARENTS,
        poses.positions_m[:, nearest],
        poses.rotations_wxyz[:, nearest],
        poses.confidence[:, nearest],
        poses.uncertainty_mm[:, nearest],
        poses.root_height_m,
    )
