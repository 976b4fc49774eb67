"""Exports of a solve: one writer per format, chosen by name.

Conversion of axes, units and names happens here and nowhere else: `options` says what is asked, `clip` makes of
poses what a file holds (`resample`, `skeleton`), `euler` angles, `bvh`, `fbx` (with its records in `fbx_binary`,
its settings in `fbx_scene`) and the other modules named as their format the files.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

from studio.engine.errors import NotAvailableError, SettingsError
from studio.engine.export.bvh import write_bvh
from studio.engine.export.c3d import write_c3d
from studio.engine.export.clip import clip, prepared_poses
from studio.engine.export.fbx import write_fbx
from studio.engine.export.glb import write_glb
from studio.engine.export.options import POSE_OPTIONS, ExportOptions, check_options
from studio.engine.export.table import write_csv, write_npz
from studio.engine.export.trc import write_trc
from studio.engine.export.usd import write_usd
from studio.engine.poses import Poses

DEFAULT_INTERPOLATION = "cubic"

_PLANNED_FORMATS = ("glb", "c3d", "trc", "csv", "npz", "usd")
_BONES = frozenset({"target", "root_motion"})


@dataclass(frozen=True)
class Exporter:
    """A format's writer.

    Attributes:
        write: called as write(what, path, options).
        takes: what the writer is given: `motion` (a `LocalMotion`, made by `clip`) or `poses` (`Poses`, made
            by `prepared_poses`).
        options: names of the options that it understands besides those of every format (`POSE_OPTIONS`).
    """

    write: Callable[[Any, str | os.PathLike[str], ExportOptions], None]
    takes: Literal["motion", "poses"]
    options: frozenset[str] = frozenset()


EXPORTERS: dict[str, Exporter] = {
    "fbx": Exporter(write_fbx, "motion", _BONES | {"interpolation", "mesh", "key_error_cm", "timecode"}),
    "bvh": Exporter(write_bvh, "motion", _BONES | {"rotation_order", "unit"}),
    "glb": Exporter(write_glb, "motion", _BONES | {"interpolation", "mesh"}),
    "c3d": Exporter(write_c3d, "poses"),
    "trc": Exporter(write_trc, "poses"),
    "csv": Exporter(write_csv, "poses"),
    "npz": Exporter(write_npz, "poses"),
    "usd": Exporter(write_usd, "motion", _BONES | {"mesh"}),
}
"""Format -> its writer."""


def export(
    poses: Poses,
    path: str | os.PathLike[str],
    format: str,
    options: ExportOptions | None = None,
    **changes: Any,
) -> None:
    """Write the poses to a file of the named format, atomically.

    Args:
        poses: what to write.
        path: of the file; an existing one is replaced, and kept whole if anything fails.
        format: a key of `EXPORTERS`.
        options: how; None = the defaults.
        changes: single options, as keywords.

    Raises:
        NotAvailableError: a documented format that this version does not have.
        SettingsError: an unknown format, or options that are not allowed or not for this format.
        FormatError: poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    exporter = exporter_of(format)
    options = replace(options or ExportOptions(), **changes)
    check_options(options, format, exporter.options)
    made = clip(poses, options) if exporter.takes == "motion" else prepared_poses(poses, options)
    exporter.write(made, path, options)


def exporter_of(format: str) -> Exporter:
    """Return the writer of a format.

    Raises:
        NotAvailableError: a documented format that this version does not have.
        SettingsError: an unknown format.
    """
    known = (*EXPORTERS, *(name for name in _PLANNED_FORMATS if name not in EXPORTERS))
    if format not in known:
        raise SettingsError(f"format={format}: allowed are {', '.join(known)}")
    if format not in EXPORTERS:
        raise NotAvailableError(
            f"format {format} is not available in this version; available: {', '.join(EXPORTERS)}"
        )
    return EXPORTERS[format]


__all__ = [
    "EXPORTERS",
    "POSE_OPTIONS",
    "ExportOptions",
    "Exporter",
    "clip",
    "export",
    "exporter_of",
    "prepared_poses",
]
