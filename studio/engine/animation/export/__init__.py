"""Exports of a solve: one writer per format, chosen by name.

Axes, units and names are converted here and nowhere else. `clip` turns poses into the content of a file, `curves`
makes keys, and each module named after its format (`bvh`, `fbx`, `glb`, ...) writes files.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Literal

from studio.engine.animation.clip.clip import clip, prepared_poses
from studio.engine.animation.clip.options import POSE_OPTIONS, ExportOptions, check_options
from studio.engine.animation.clip.skeleton import LocalMotion
from studio.engine.animation.clip.together import identifiers, on_one_clock
from studio.engine.base.errors import SettingsError
from studio.engine.base.sentences import say
from studio.engine.model.poses import Poses

_PREPARING = 0.4
"""Share of the progress before writing starts."""

_BONES = frozenset({"target", "root_motion"})
_TIMECODES = frozenset({"timecodes"})


@dataclass(frozen=True)
class Exporter:
    """A format's writer.

    Attributes:
        write: called as write(what, path, options).
        takes: input of the writer: `motion` (a `LocalMotion`, made by `clip`) or `poses` (`Poses`, made
            by `prepared_poses`).
        options: names of the options that it understands besides those of every format (`POSE_OPTIONS`).
        several: whether it takes a list of takes for one file (poses with their options), and a `progress`.
        scene: writes several performers of a take, by name, called as scene(performers, path, options); None = the
            format holds one.
        stage_times: whether each frame has its stage time; else a file begins with its first frame.
        needs: an optional module that it requires.
        install: the command that installs `needs`.
    """

    write: Callable[..., None]
    takes: Literal["motion", "poses"]
    options: frozenset[str] = frozenset()
    several: bool = False
    scene: Callable[..., None] | None = None
    stage_times: bool = False
    needs: str = ""
    install: str = ""

    @property
    def missing(self) -> str:
        """Why this format cannot be written here, with the command that installs its module; "" if it can."""
        if not self.needs or find_spec(self.needs):
            return ""
        return say("export.not_installed", "not installed here: {command}", command=self.install)


def _writer(module: str, name: str) -> Callable[..., None]:
    """Return a writer that imports its module and library on its first call."""

    def write(*args: Any, **kwargs: Any) -> None:
        getattr(import_module(f"{__name__}.{module}"), name)(*args, **kwargs)

    return write


EXPORTERS: dict[str, Exporter] = {
    "fbx": Exporter(
        _writer("fbx.writer", "write_fbx"),
        "motion",
        _BONES | {"interpolation", "mesh", "key_error_cm", "timecode", "timecodes"},
        several=True,
        scene=_writer("fbx.writer", "write_fbx_scene"),
    ),
    "bvh": Exporter(_writer("bvh", "write_bvh"), "motion", _BONES | {"rotation_order", "unit", "timecodes"}),
    "glb": Exporter(
        _writer("glb", "write_glb"),
        "motion",
        _BONES | {"interpolation", "mesh"},
        scene=_writer("glb", "write_glb_scene"),
    ),
    "c3d": Exporter(
        _writer("c3d", "write_c3d"), "poses", _TIMECODES, needs="ezc3d", install="pip install ezc3d"
    ),
    "trc": Exporter(_writer("trc", "write_trc"), "poses"),
    "csv": Exporter(_writer("table", "write_csv"), "poses", _TIMECODES, stage_times=True),
    "npz": Exporter(_writer("table", "write_npz"), "poses", _TIMECODES, stage_times=True),
    "usd": Exporter(
        _writer("usd", "write_usd"),
        "motion",
        _BONES | {"mesh", "timecodes"},
        scene=_writer("usd", "write_usd_scene"),
        needs="pxr",
        install="pip install 'capture-studio[usd]' (209 MB)",
    ),
    "otio": Exporter(_writer("otio", "write_otio"), "poses", _TIMECODES, several=True),
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
        poses: the solve.
        path: of the file; an existing one is replaced, or stays intact if anything fails.
        format: a key of `EXPORTERS`.
        options: of the export; None = the defaults.
        progress: receives the share done.
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
    """Write one or several takes to one file, atomically; several only in formats that hold several.

    Args:
        takes: poses and options of each; the first take's options decide how the file is written.
        path: of the file.
        format: a key of `EXPORTERS`.
        progress: receives the share done.
        onto: as in `clip`.
        write: replaces the format's own writer, for one take.

    Raises:
        SettingsError: as `export`; several takes in a format for one; takes that cannot share a file.
        FormatError: poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    exporter = exporter_of(format)
    if len(takes) > 1 and not exporter.several:
        allowed = ", ".join(name for name, one in EXPORTERS.items() if one.several)
        raise SettingsError(
            "export.one_take_format",
            "format={format}: a file holds one take; several go into {allowed}",
            format=format,
            allowed=allowed,
        )
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
        what = made if exporter.takes == "motion" else list(zip(made, (own for _, own in takes), strict=True))
        exporter.write(
            what, path, takes[0][1], progress=lambda share: told(_PREPARING + (1 - _PREPARING) * share)
        )
    else:
        (write or exporter.write)(made[0], path, takes[0][1])
    told(1.0)


def export_scene(
    performers: Sequence[tuple[str, Poses, ExportOptions]],
    path: str | os.PathLike[str],
    format: str,
    *,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write the performers of a take to one file, atomically, all in the coordinates and on the clock of the stage.

    Args:
        performers: name, poses and options of each; the first one's options decide how the file is written. Names
            become namespaces: letters, digits and `_`.
        path: of the file.
        format: one of those that hold several performers.
        progress: receives the share done.

    Raises:
        SettingsError: as `export`; a format for one performer; or a loop, which would differ between performers.
        FormatError: poses that cannot be exported.
        StudioError: the file cannot be written.
    """
    exporter = exporter_of(format)
    if exporter.scene is None:
        raise one_performer_format(format)
    told = progress or (lambda share: None)
    options = performers[0][2]
    if options.loop:
        raise SettingsError(
            "export.loop_together",
            "loop: each performer would have a loop of their own; export each to a file of its own",
        )
    motions = []
    poses_of = on_one_clock([poses for _, poses, _ in performers])
    for k, (poses, (_, _, own)) in enumerate(zip(poses_of, performers, strict=True)):
        check_options(own, format, exporter.options)
        motions.append(clip(poses, own))
        told(_PREPARING * (k + 1) / len(performers))
    names = identifiers([name for name, _, _ in performers])
    exporter.scene(list(zip(names, motions, strict=True)), path, options)
    told(1.0)


def one_performer_format(format: str) -> SettingsError:
    """Return the error for several performers in a format that holds one."""
    allowed = ", ".join(name for name, one in EXPORTERS.items() if one.scene is not None)
    return SettingsError(
        "export.one_performer_format",
        "format={format}: a file holds one performer; several go into {allowed}; export each to a file of its own",
        format=format,
        allowed=allowed,
    )


def exporter_of(format: str) -> Exporter:
    """Return the writer of a format.

    Raises:
        SettingsError: an unknown format.
    """
    if format not in EXPORTERS:
        raise SettingsError(
            "export.value",
            "{name}={value}: allowed are {allowed}",
            name="format",
            value=format,
            allowed=[*EXPORTERS],
        )
    return EXPORTERS[format]


__all__ = [
    "EXPORTERS",
    "POSE_OPTIONS",
    "ExportOptions",
    "Exporter",
    "clip",
    "export",
    "export_scene",
    "export_takes",
    "exporter_of",
    "one_performer_format",
    "prepared_poses",
]
