"""Exports of takes onto a rig, with the writers of `export`."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from studio.engine.animation.clip.options import UNITS_M
from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.export import ExportOptions, export_takes, exporter_of
from studio.engine.animation.retarget.files import read_rig
from studio.engine.animation.retarget.glb import write_onto_glb
from studio.engine.animation.retarget.mapping import (
    Mapping,
    load_mapping,
    mapping_of,
    saved_bones,
)
from studio.engine.animation.retarget.rig import Rig
from studio.engine.animation.retarget.transfer import retargeted
from studio.engine.base.errors import SettingsError
from studio.engine.model.poses import Poses


@dataclass(frozen=True)
class Onto:
    """A rig to export onto, and the source of its mapping.

    Attributes:
        mapping: checked.
        rig: as in the file.
        source: the file of the mapping; None for a mapping by the bones' names.
    """

    mapping: Mapping
    rig: Rig
    source: Path | None


def open_rig(path: str | os.PathLike[str], mapping: str | os.PathLike[str] | None = None) -> Onto:
    """Return a user's rig with its mapping: the given one, else the saved one for these bones, else by their names.

    Raises:
        FormatError: as `read_rig`, `load_mapping` and `mapping_of`.
        NotAvailableError: the file is an FBX, and the package ufbx is not installed.
    """
    return _opened(read_rig(path), None if mapping is None else Path(mapping))


def _opened(rig: Rig, mapping: Path | None) -> Onto:
    if mapping is not None:
        return Onto(mapping_of(rig, load_mapping(mapping)[1]), rig, mapping)
    saved = saved_bones(rig)
    if saved is not None:
        return Onto(mapping_of(rig, saved[0]), rig, saved[1])
    return Onto(mapping_of(rig), rig, None)


def export_onto(
    takes: Sequence[tuple[Poses, ExportOptions]],
    path: str | os.PathLike[str],
    format: str,
    onto: Onto,
    *,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write takes onto a rig, atomically, as `export_takes` does onto the performer's own skeleton.

    A GLB onto a GLB keeps the file, its meshes and materials, with the take as its one animation. A BVH onto a BVH
    keeps its unit.

    Raises:
        SettingsError: a format of points; or a target, a body or a unit that conflicts with the rig's.
        FormatError: a rig that cannot be retargeted, or poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    if exporter_of(format).takes != "motion":
        raise SettingsError(
            "rig.points_format",
            "rig: {format} holds points, not bones; leave the option out, or choose fbx, bvh, glb, usd",
            format=format,
        )
    for _, options in takes:
        if options.target != "humanik":
            raise SettingsError(
                "rig.has_own_bones",
                "target={target}: a rig has bones of its own; leave one of the two out",
                target=options.target,
            )
        if options.mesh:
            raise SettingsError("rig.has_own_body", "mesh: a rig has a body of its own; leave the option out")
    if Path(path).resolve() == onto.rig.path.resolve():
        raise SettingsError(
            "rig.same_file", "out={path}: this is the rig itself; give another file", path=path
        )
    takes = [(poses, _options(options, format, onto.rig)) for poses, options in takes]

    def moved(motion: LocalMotion, options: ExportOptions) -> LocalMotion:
        return retargeted(motion, onto.mapping, options.root_motion)

    def write_onto(motion: LocalMotion, out: str | os.PathLike[str], options: ExportOptions) -> None:
        write_onto_glb(motion, onto.mapping.rig, out, options)

    into_rig = format == "glb" and onto.rig.path.suffix.lower() in (".glb", ".gltf")
    write = write_onto if into_rig else None
    export_takes(takes, path, format, progress=progress, onto=moved, write=write)


def _options(options: ExportOptions, format: str, rig: Rig) -> ExportOptions:
    """Return options without the studio's body, and with the unit that a BVH rig has."""
    if format in ("glb", "usd"):
        return replace(options, mesh=False)
    if format == "bvh" and rig.unit_m is not None:
        unit = next(name for name, unit_m in UNITS_M.items() if unit_m == rig.unit_m)
        if options.unit not in (ExportOptions().unit, unit):
            raise SettingsError(
                "rig.has_own_unit",
                "unit={unit}: {rig} has {own}; leave the option out",
                unit=options.unit,
                rig=rig.path.name,
                own=unit,
            )
        return replace(options, unit=unit)
    return options
