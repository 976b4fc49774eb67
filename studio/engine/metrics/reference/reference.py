"""A reference motion, against which a solve is measured."""

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from studio.engine.animation.motion.canonical import to_canonical
from studio.engine.animation.motion.motion import Motion
from studio.engine.animation.read.files import ENDINGS, read_animation
from studio.engine.animation.read.landmarks import canonical_points, uses_markers
from studio.engine.animation.read.points import NamedPoints
from studio.engine.base.errors import FormatError
from studio.engine.metrics.reference.canonical import canonical_positions
from studio.engine.metrics.reference.kinds import REFERENCE_KINDS
from studio.engine.metrics.reference.points_csv import read_points_csv, write_points_csv
from studio.engine.metrics.reference.target_table import read_target_table
from studio.engine.model.joints import CANONICAL, INDEX, JOINT_COUNT
from studio.engine.model.poses import Poses

LONGEST_STEP_S, _GAP_STEPS = 0.5, 5.0
"""Time and number of usual steps above which the gap between two samples is unknown."""


@dataclass(frozen=True)
class Reference:
    """Joint positions over time, on any rigid frame with z up.

    Attributes:
        time_s: on the reference's clock [s], shape (sample_count,), increasing.
        positions_m: canonical joints [m], shape (sample_count, 21, 3); NaN = unknown.
    """

    time_s: NDArray[np.float64]
    positions_m: NDArray[np.float64]

    def __post_init__(self) -> None:
        if self.positions_m.shape != (len(self.time_s), JOINT_COUNT, 3):
            raise FormatError(
                "reference.shape",
                "a reference needs positions of shape {wanted}; got {shape}",
                wanted=(len(self.time_s), JOINT_COUNT, 3),
                shape=self.positions_m.shape,
            )
        if len(self.time_s) < 4:
            raise FormatError(
                "reference.few_samples", "a reference needs at least 4 samples; got {n}", n=len(self.time_s)
            )
        if not (np.isfinite(self.time_s).all() and (np.diff(self.time_s) > 0).all()):
            raise FormatError("reference.times", "the times of a reference must be finite and increasing")

    @property
    def known(self) -> NDArray[np.bool_]:
        """Canonical joints that the reference has at some time, shape (21,)."""
        return np.any(np.isfinite(self.positions_m).all(axis=2), axis=0)

    @property
    def known_joints(self) -> list[str]:
        """Names of the canonical joints that are `known`."""
        return [name for name, known in zip(CANONICAL, self.known, strict=True) if known]

    def at(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the positions at other times [s], shape (len(time_s), 21, 3), by cubic splines.

        NaN outside the reference's time, where a sample on either side is unknown, and in gaps, such as those of a
        solve that lost its performer.
        """
        out = np.full((len(time_s), JOINT_COUNT, 3), np.nan)
        inside = (time_s >= self.time_s[0]) & (time_s <= self.time_s[-1])
        after = np.clip(np.searchsorted(self.time_s, time_s), 1, len(self.time_s) - 1)
        steps_s = np.diff(self.time_s)
        inside &= steps_s[after - 1] <= max(LONGEST_STEP_S, _GAP_STEPS * float(np.median(steps_s)))
        for joints, valid, spline in self._splines:
            usable = inside & valid[after] & valid[after - 1]
            out[np.ix_(usable, joints)] = spline(time_s[usable])
        return out

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the known joints as `read_points_csv` reads them, atomically.

        Raises:
            StudioError: the file cannot be written.
        """
        write_points_csv(path, self.time_s, self.known_joints, self.positions_m[:, self.known])

    @cached_property
    def _splines(self) -> list[tuple[NDArray[np.int64], NDArray[np.bool_], Any]]:
        """Splines of each group of joints known in the same samples: joints, those samples, spline."""
        from scipy.interpolate import CubicSpline  # slow to load: not at the start of the server

        known = np.isfinite(self.positions_m).all(axis=2)
        splines = []
        for pattern in np.unique(known.T, axis=0):
            if pattern.sum() >= 4:
                joints = np.flatnonzero((known.T == pattern).all(axis=1))
                samples = self.positions_m[np.ix_(pattern, joints)]
                splines.append((joints, pattern, CubicSpline(self.time_s[pattern], samples)))
        return splines


@dataclass(frozen=True)
class Markers:
    """Markers or rigid targets over time, on any rigid frame with z up.

    Attributes:
        time_s: on the reference's clock [s], shape (sample_count,), increasing.
        joints: the canonical joint of each marker, each at most once.
        positions_m: shape (sample_count, marker_count, 3); NaN = not seen.
        rotations: world rotations of rigid targets, shape (sample_count, marker_count, 3, 3), in whose axes the
            offsets are constant; None for plain markers, whose offsets are constant in the solve's joint.
    """

    time_s: NDArray[np.float64]
    joints: tuple[str, ...]
    positions_m: NDArray[np.float64]
    rotations: NDArray[np.float64] | None = None

    def as_reference(self, joint_centres_m: NDArray[np.float64] | None = None) -> Reference:
        """Return the joint centres, or the bare markers instead, as a reference."""
        positions = np.full((len(self.time_s), JOINT_COUNT, 3), np.nan)
        positions[:, [INDEX[name] for name in self.joints]] = (
            self.positions_m if joint_centres_m is None else joint_centres_m
        )
        return Reference(self.time_s, positions)


def read_reference(path: str | os.PathLike[str], *, unit_m: float | None = None) -> "Reference | Markers":
    """Return the reference in a file, by its kind; one without a clock begins at time 0.

    Joint centres: CSV (see `read_points_csv`), BVH, FBX, GLB, C3D and TRC of joint centres, a solve's `poses.npz`.
    Markers: C3D, TRC and CSV of markers (`animation.read.landmarks`), a table of rigid targets (.txt).

    Args:
        path: the file.
        unit_m: metres per unit of a BVH; None = its rest pose is 1.75 m high.

    Raises:
        FormatError: the file is missing, damaged or of an unknown kind; the message names the line.
        NotAvailableError: the package that reads a kind (FBX) is not installed.
        SettingsError: a unit for a file that states its own.
    """
    path = Path(path)
    if not path.is_file():
        raise FormatError(
            "reference.none",
            "no reference at {path}; give a CSV with time_s,<joint>_x,<joint>_y,<joint>_z,...",
            path=path,
        )
    kind = path.suffix.lower()
    if kind == ".csv":
        return _of_csv(read_points_csv(path))
    if kind in ENDINGS:
        animation = read_animation(path, unit_m=unit_m)
        if not isinstance(animation, Motion):
            return _of_points(animation)
        motion = to_canonical(animation)
        return Reference(time_s=motion.times_s(), positions_m=motion.positions_m)
    if kind == ".npz":
        poses = Poses.load(path)
        return Reference(poses.time_s, canonical_positions(poses))
    if kind == ".txt":
        return Markers(*read_target_table(path))
    raise FormatError(
        "reference.kind",
        "{path}: a reference is one of {kinds}; this one ends in {kind}",
        path=path,
        kinds=[*REFERENCE_KINDS],
        kind=kind or "nothing",
    )


class ReferenceFacts(Struct):
    """A reference's kind (`joints` or `markers`), length [s], rate [Hz] and joints."""

    kind: Literal["joints", "markers"]
    seconds: float
    rate_hz: float
    joints: list[str]


def reference_facts(path: Path) -> ReferenceFacts:
    """Return facts of a reference.

    Raises:
        FormatError: it cannot be read; the message names the file without its folder.
    """
    try:
        motion = read_reference(path)
    except FormatError as error:
        raise FormatError(error.sentence.replace(str(path), path.name)) from error
    known = isinstance(motion, Reference)
    return ReferenceFacts(
        kind="joints" if known else "markers",
        seconds=round(float(motion.time_s[-1] - motion.time_s[0]), 3),
        rate_hz=round(float(1.0 / np.median(np.diff(motion.time_s))), 3),
        joints=motion.known_joints if known else list(motion.joints),
    )


def _of_csv(points: NamedPoints) -> "Reference | Markers":
    """Return joint centres if joints are named (there are then no other points); else markers."""
    if points.names[0] not in INDEX:
        return _of_points(points)
    positions = np.full((len(points.time_s), JOINT_COUNT, 3), np.nan)
    positions[:, [INDEX[name] for name in points.names]] = points.positions_m
    return Reference(points.time_s, positions)


def _of_points(points: NamedPoints) -> "Reference | Markers":
    """Return joint centres by name; centres estimated from markers keep a constant offset and count as markers."""
    joints = canonical_points(points)
    if not uses_markers(points):
        return Reference(points.time_s, joints)
    known = np.flatnonzero(np.isfinite(joints).all(axis=2).any(axis=0))
    return Markers(points.time_s, tuple(CANONICAL[k] for k in known), joints[:, known])
