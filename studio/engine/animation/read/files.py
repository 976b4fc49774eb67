"""The animation files that can be read, as a skeleton's motion, as points, or as canonical joints of either."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.engine.animation.motion.bvh import read_bvh
from studio.engine.animation.motion.canonical import to_canonical
from studio.engine.animation.motion.motion import CanonicalMotion, Motion
from studio.engine.animation.motion.proportions import t_pose_offsets
from studio.engine.animation.read.c3d import read_c3d
from studio.engine.animation.read.fbx import read_fbx
from studio.engine.animation.read.gltf import read_gltf
from studio.engine.animation.read.landmarks import canonical_points
from studio.engine.animation.read.points import NamedPoints
from studio.engine.animation.read.trc import read_trc
from studio.engine.base.errors import FormatError, SettingsError
from studio.engine.model.joints import INDEX

SKELETONS: dict[str, Callable[[Path], Motion]] = {
    ".fbx": read_fbx, ".glb": read_gltf, ".gltf": read_gltf, ".bvh": read_bvh,
}  # fmt: skip
POINTS: dict[str, Callable[[Path], NamedPoints]] = {".c3d": read_c3d, ".trc": read_trc}
ENDINGS: tuple[str, ...] = (*SKELETONS, *POINTS)
"""Endings of files that `read_animation` reads."""

_FEET = [INDEX[f"{side}_{joint}"] for side in ("left", "right") for joint in ("ankle", "toe")]
_SPINE_SHARE = 0.33  # of the way from the hips to the chest: the lowest joint of the back


def read_animation(path: str | os.PathLike[str], *, unit_m: float | None = None) -> Motion | NamedPoints:
    """Return the content of an animation file, by its ending.

    Args:
        path: the file.
        unit_m: metres per unit of a BVH; None = its rest pose is 1.75 m high. Other files state their unit.

    Raises:
        FormatError: an unknown ending, or as the reader of that kind.
        NotAvailableError: the package of an optional reader is not installed.
        SettingsError: a unit for a file that states its own.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind == ".bvh":
        return read_bvh(path, unit_m=unit_m)
    if kind not in ENDINGS:
        raise FormatError(
            "animation.ending",
            "{path}: an animation ends in {kinds}; convert it to one of them",
            path=path,
            kinds=[*ENDINGS],
        )
    if unit_m is not None:
        raise SettingsError(
            "animation.unit",
            "a unit of {m:g} m: a {kind} file tells its own; leave it out",
            m=unit_m,
            kind=kind,
        )
    return SKELETONS[kind](path) if kind in SKELETONS else POINTS[kind](path)


def canonical_animation(path: str | os.PathLike[str], *, unit_m: float | None = None) -> CanonicalMotion:
    """Return an animation file's motion in canonical joints; gaps of points are interpolated.

    Raises:
        FormatError, NotAvailableError, SettingsError: as `read_animation`; or points that lack a joint.
    """
    animation = read_animation(path, unit_m=unit_m)
    if isinstance(animation, Motion):
        return to_canonical(animation)
    joints = joints_of_points(animation, str(path))
    missing = [name for name, joint in INDEX.items() if np.isnan(joints[:, joint]).any()]
    if missing:
        raise FormatError(
            "animation.points_lack",
            "{path}: no point tells {names}; give a recording with more markers",
            path=path,
            names=[*missing],
        )
    tallest = joints[int(np.argmax(joints[:, INDEX["head"], 2] - joints[:, _FEET, 2].min(axis=1)))]
    frame_s = float(np.median(np.diff(animation.time_s)))
    return CanonicalMotion(frame_s, joints, t_pose_offsets(tallest), np.ones((len(joints), 2)))


def joints_of_points(points: NamedPoints, what: str) -> NDArray[np.float64]:
    """Return canonical joints with their gaps interpolated [m], shape (frame_count, 21, 3); NaN = never known.

    Hips without a point are between the hip joints; a spine without one is on the line to the chest.

    Raises:
        FormatError: fewer than two frames, or no points for the hips.
    """
    told = canonical_points(points).transpose(1, 0, 2)
    joints = np.stack([bridged(points.time_s, track) for track in told], axis=1)
    sides = joints[:, [INDEX["left_hip"], INDEX["right_hip"]]].mean(axis=1)
    joints[:, 0] = np.where(np.isfinite(joints[:, 0]), joints[:, 0], sides)
    spine, chest = INDEX["spine"], INDEX["chest"]
    way = joints[:, 0] + _SPINE_SHARE * (joints[:, chest] - joints[:, 0])
    joints[:, spine] = np.where(np.isfinite(joints[:, spine]), joints[:, spine], way)
    if len(joints) < 2 or np.isnan(joints[:, 0]).any():
        raise FormatError(
            "animation.no_hips_point",
            "{what}: no point tells where the hips are in two frames or more; name its points",
            what=what,
        )
    return joints


def bridged(time_s: NDArray[np.float64], track: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a point's path, shape (F, 3), interpolated across gaps and constant at its ends; NaN where it has
    none."""
    seen = np.isfinite(track).all(axis=1)
    if not seen.any():
        return track
    return np.stack([np.interp(time_s, time_s[seen], track[seen, k]) for k in range(3)], axis=1)
