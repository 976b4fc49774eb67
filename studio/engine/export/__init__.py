"""Exports of a solve: one writer per format, chosen by name.

Conversion of axes, units and names happens here and nowhere else: `skeleton` makes local keys in file axes,
`euler` angles, `bvh` and `fbx` (with its records in `fbx_binary`, its settings in `fbx_scene`) the files.
"""

import os
from collections.abc import Callable

from studio.engine.errors import NotAvailableError, SettingsError
from studio.engine.export.bvh import write_bvh
from studio.engine.export.fbx import INTERPOLATIONS, write_fbx
from studio.engine.poses import Poses

DEFAULT_INTERPOLATION = "cubic"

_PLANNED_FORMATS = ("glb", "c3d", "trc", "csv", "npz", "usd")
_TARGETS = ("humanik", "mixamo", "unreal", "vrm")
_ROOT_MOTIONS = ("hips", "root", "in-place")


def _bvh(poses: Poses, path: str | os.PathLike[str], *, fps: float | None, interpolation: str) -> None:
    if interpolation != DEFAULT_INTERPOLATION:
        raise SettingsError(
            f"interpolation={interpolation}: a BVH file has none (each program chooses its own); "
            "leave it out, or export fbx"
        )
    write_bvh(poses, path, fps=fps)


EXPORTERS: dict[str, Callable[..., None]] = {"fbx": write_fbx, "bvh": _bvh}
"""Format -> writer(poses, path, *, fps, interpolation)."""


def export(
    poses: Poses,
    path: str | os.PathLike[str],
    format: str,
    *,
    fps: float | None = None,
    interpolation: str = DEFAULT_INTERPOLATION,
    target: str = "humanik",
    root_motion: str = "hips",
    mesh: bool = False,
) -> None:
    """Write the poses to a file of the named format, atomically.

    Args:
        poses: what to write.
        path: of the file; an existing one is replaced, and kept whole if anything fails.
        format: a key of `EXPORTERS`.
        fps: frame rate of the keys [Hz]; None keeps that of the poses.
        interpolation: between keys, `cubic`, `linear` or `constant`, where the format has it.
        target: naming of the skeleton; root_motion: where the path of the performer goes; mesh: with a body.

    Raises:
        NotAvailableError: a documented format or option that this version does not have.
        SettingsError: an unknown format or value.
        FormatError: poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    known = (*EXPORTERS, *_PLANNED_FORMATS)
    _choose("format", format, known, EXPORTERS)
    _choose("interpolation", interpolation, INTERPOLATIONS, INTERPOLATIONS)
    _choose("target", target, _TARGETS, ("humanik",))
    _choose("root-motion", root_motion, _ROOT_MOTIONS, ("hips",))
    if mesh:
        raise NotAvailableError("export with a mesh is not available in this version; leave out --mesh")
    EXPORTERS[format](poses, path, fps=fps, interpolation=interpolation)


def _choose(option: str, value: str, known: tuple[str, ...], available: tuple[str, ...] | dict) -> None:
    if value not in known:
        raise SettingsError(f"{option}={value}: allowed are {', '.join(known)}")
    if value not in available:
        raise NotAvailableError(
            f"{option} {value} is not available in this version; available: {', '.join(available)}"
        )
