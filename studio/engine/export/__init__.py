"""Exports of a solve: one writer per format, chosen by name.

Conversion of axes, units and names happens here and nowhere else: `options` says what is asked, `clip` makes of
poses what a file holds (`resample`, `skeleton`), `euler` angles, `bvh`, `fbx` (with its records in `fbx_binary`,
its settings in `fbx_scene`) and the other modules named as their format the files.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Literal

from studio.engine.errors import SettingsError
from studio.engine.export.clip import clip, prepared_poses
from studio.engine.export.options import POSE_OPTIONS, ExportOptions, check_options
from studio.engine.export.skeleton import LocalMotion
from studio.engine.poses import Poses

_PREPARING = 0.4
"""Share of the work before anything is written."""

_BONES = frozenset({"target", "root_motion"})


@dataclass(frozen=True)
class Exporter:
    """A format's writer.

    Attributes:
        write: called as write(what, path, options).
        takes: what the writer is given: `motion` (a `LocalMotion`, made by `clip`) or `poses` (`Poses`, made
            by `prepared_poses`).
        options: names of the options that it understands besides those of every format (`POSE_OPTIONS`).
        several: whether it is given a list of takes for one file, and tells by `progress` how far it is.
    """

    write: Callable[..., None]
    takes: Literal["motion", "poses"]
    options: frozenset[str] = frozenset()
    several: bool = False


def _writer(module: str, name: str) -> Callable[..., None]:
    """Return a writer that loads its module, and the library that it needs, when something is written."""

    def write(*args: Any, **kwargs: Any) -> None:
        getattr(import_module(f"{__name__}.{module}"), name)(*args, **kwargs)

    return write


EXPORTERS: dict[str, Exporter] = {
    "fbx": Exporter(
        _writer("fbx", "write_fbx"),
        "motion",
        _BONES | {"interpolation", "mesh", "key_error_cm", "timecode"},
        several=True,
    ),
    "bvh": Exporter(_writer("bvh", "write_bvh"), "motion", _BONES | {"rotation_order", "unit"}),
    "glb": Exporter(_writer("glb", "write_glb"), "motion", _BONES | {"interpolation", "mesh"}),
    "c3d": Exporter(_writer("c3d", "write_c3d"), "poses"),
    "trc": Exporter(_writer("trc", "write_trc"), "poses"),
    "csv": Exporter(_writer("table", "write_csv"), "poses"),
    "npz": Exporter(_writer("table", "write_npz"), "poses"),
    "usd": Exporter(_writer("usd", "write_usd"), "motion", _BONES | {"mesh"}),
}
"""Format -> its writer."""


def export(
    poses: Poses,
    path: str | os.PathLike[str],
    format: str,
    options: ExportOptions | None = None,
    *,
    progress: Callable[[float], None] | None = None,
    **changes: Any,
) -> None:
    """Write the poses to a file of the named format, atomically.

    Args:
        poses: what to write.
        path: of the file; an existing one is replaced, and kept whole if anything fails.
        format: a key of `EXPORTERS`.
        options: how; None = the defaults.
        progress: told the share that is done.
        changes: single options, as keywords.

    Raises:
        SettingsError: an unknown format, or options that are not allowed or not for this format.
        FormatError: poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    export_takes([(poses, replace(options or ExportOptions(), **changes))], path, format, progress=progress)


def export_takes(
    takes: Sequence[tuple[Poses, ExportOptions]],
    path: str | os.PathLike[str],
    format: str,
    *,
    progress: Callable[[float], None] | None = None,
    onto: Callable[[LocalMotion, ExportOptions], LocalMotion] | None = None,
    write: Callable[..., None] | None = None,
) -> None:
    """Write one or several takes to one file, atomically; several only where the format holds several.

    Args:
        takes: poses, and how each is exported; how the file is written says the first.
        path: of the file.
        format: a key of `EXPORTERS`.
        progress: told the share that is done.
        onto: as `clip` has it.
        write: instead of the format's own writer, for one take.

    Raises:
        SettingsError: as `export`; several takes in a format of one; takes that do not go into one file.
        FormatError: poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    exporter = exporter_of(format)
    if len(takes) > 1 and not exporter.several:
        allowed = ", ".join(name for name, one in EXPORTERS.items() if one.several)
        raise SettingsError(f"format={format}: a file holds one take; several go into {allowed}")
    told = progress or (lambda share: None)
    for _, options in takes:
        check_options(options, format, exporter.options)
    made = []
    for k, (poses, options) in enumerate(takes):
        made.append(
            clip(poses, options, onto) if exporter.takes == "motion" else prepared_poses(poses, options)
        )
        told(_PREPARING * (k + 1) / len(takes))
    if exporter.several:
        exporter.write(
            made, path, takes[0][1], progress=lambda share: told(_PREPARING + (1 - _PREPARING) * share)
        )
    else:
        (write or exporter.write)(made[0], path, takes[0][1])
    told(1.0)


def exporter_of(format: str) -> Exporter:
    """Return the writer of a format.

    Raises:
        SettingsError: an unknown format.
    """
    if format not in EXPORTERS:
        raise SettingsError(f"format={format}: allowed are {', '.join(EXPORTERS)}")
    return EXPORTERS[format]


__all__ = [
    "EXPORTERS",
    "POSE_OPTIONS",
    "ExportOptions",
    "Exporter",
    "clip",
    "export",
    "export_takes",
    "exporter_of",
    "prepared_poses",
]
