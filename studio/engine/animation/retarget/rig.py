"""A user's own skeleton in its rest pose, read from a file and checked."""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.base.errors import FormatError

Array = NDArray[np.float64]

MAX_BONES = 1024
MAX_DEPTH = 200
"""Longest chain of bones."""

_SAME_SCALE = 1e-3


@dataclass(frozen=True)
class Rig:
    """The bones of a file in file axes (y up) and metres; there may be skeletons of several characters.

    Attributes:
        path: the file.
        joint_names: unique, shape (J,); duplicate names are numbered.
        parents: index of each bone's parent, -1 for a root; parents come before children, shape (J,).
        positions_m: world positions of the rest pose, shape (J, 3).
        rotations_wxyz: world rotations of the rest pose, shape (J, 4).
        numbers: of each bone in the file, shape (J,): a glTF's nodes.
        unit_m: metres per unit of a BVH; None for files that state their own.
    """

    path: Path
    joint_names: tuple[str, ...]
    parents: NDArray[np.int64]
    positions_m: Array
    rotations_wxyz: Array
    numbers: NDArray[np.int64]
    unit_m: float | None = None

    @property
    def identity(self) -> str:
        """Identifier of the rig: a hash of its bones' names and parents."""
        rows = (f"{name}\t{parent}" for name, parent in zip(self.joint_names, self.parents, strict=True))
        return sha256("\n".join(rows).encode()).hexdigest()[:16]

    def below(self, joint: int, above: int) -> bool:
        """Whether a joint is a descendant of another one."""
        while joint >= 0 and joint != above:
            joint = int(self.parents[joint])
        return joint >= 0

    def tree_of(self, joint: int) -> "Rig":
        """Return the rig reduced to the tree of a joint."""
        root = joint
        while self.parents[root] >= 0:
            root = int(self.parents[root])
        inside = np.array([self.below(k, root) for k in range(len(self.parents))])
        keep = np.flatnonzero(inside)
        place = {int(k): n for n, k in enumerate(keep)}
        return Rig(
            path=self.path,
            joint_names=tuple(self.joint_names[k] for k in keep),
            parents=np.array([place.get(int(self.parents[k]), -1) for k in keep], dtype=np.int64),
            positions_m=self.positions_m[keep],
            rotations_wxyz=self.rotations_wxyz[keep],
            numbers=self.numbers[keep],
            unit_m=self.unit_m,
        )


def check_size(path: Path, parents: NDArray[np.int64]) -> None:
    """Refuse a skeleton with no bones, too many bones or too long chains.

    Raises:
        FormatError: with the number found and the number allowed.
    """
    if len(parents) == 0:
        raise FormatError("rig.no_bone", "{path} has no bone; give a file with a skeleton", path=path)
    if len(parents) > MAX_BONES:
        raise FormatError(
            "rig.bones",
            "{path} has {n} bones; allowed are {most}; export the skeleton alone",
            path=path,
            n=len(parents),
            most=MAX_BONES,
        )
    depths = np.zeros(len(parents), dtype=np.int64)
    for joint, parent in enumerate(parents.tolist()):
        depths[joint] = 0 if parent < 0 else depths[parent] + 1
    if depths.max() > MAX_DEPTH:
        raise FormatError(
            "rig.chain",
            "{path} has a chain of {n} bones; allowed are {most}",
            path=path,
            n=depths.max(),
            most=MAX_DEPTH,
        )


def check_scales(path: Path, names: list[str], matrices: Array) -> None:
    """Refuse bones that are stretched, mirrored, or scaled to zero, because rotation keys cannot express this.

    Args:
        path: for the message.
        names: of the bones, shape (J,).
        matrices: their world matrices, shape (J, 4, 4).

    Raises:
        FormatError: with the first such bone.
    """
    if not np.isfinite(matrices).all():
        raise FormatError(
            "rig.not_finite", "{path}: a transform is not a finite number; export the file again", path=path
        )
    sizes = np.linalg.norm(matrices[:, :3, :3], axis=1)
    for name, size, matrix in zip(names, sizes, matrices, strict=True):
        if size.min() < 1e-9:
            raise FormatError(
                "rig.scaled_to_nothing",
                "{path}: bone {bone!r} is scaled to nothing; apply or remove the scale",
                path=path,
                bone=name,
            )
        uneven = size.max() > (1 + _SAME_SCALE) * size.min()
        skewed = np.abs(matrix[:3, :3].T @ matrix[:3, :3] / size.max() ** 2 - np.eye(3)).max() > 0.01
        if uneven or skewed or np.linalg.det(matrix[:3, :3]) < 0:
            shown = " x ".join(f"{value:.3g}" for value in size)
            raise FormatError(
                "rig.scaled",
                "{path}: bone {bone!r} is scaled by {scale} or mirrored; only uniform scales can be "
                "kept: apply the scale to the skeleton and export it again",
                path=path,
                bone=name,
                scale=shown,
            )
