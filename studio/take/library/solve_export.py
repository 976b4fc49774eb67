"""Export of solves for other programs."""

import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.export import export_takes
from studio.engine.base.files import write_atomically
from studio.engine.model.poses import Poses

Progress = Callable[[float], None]


@dataclass(frozen=True)
class SolveExport:
    """One solve: its `poses.npz`, its output file, the options, and its name in an archive."""

    poses: Path
    out: Path
    options: ExportOptions
    name: str


def export_solves(
    solves: Sequence[SolveExport],
    out: Path,
    format: str,
    rig: Path | None = None,
    *,
    together: bool = False,
    progress: Progress | None = None,
) -> None:
    """Export solves: one to one file, several to an archive at `out`, or `together` into one file at `out`.

    Args:
        solves: at least one.
        out: the file to make.
        format: a key of `EXPORTERS`.
        rig: file of a rig to export onto; None = the performer's own skeleton.
        together: all in one file, if the format holds several.
        progress: receives the share done.

    Raises:
        SettingsError: options that are not allowed, or not for this format or rig.
        FormatError: poses or a rig that cannot be read or exported.
        StudioError: a file cannot be written.
    """
    told = progress or (lambda share: None)
    if together and len(solves) > 1:
        _export(solves, out, format, rig, told)
        return
    share = 1.0 / len(solves)
    for k, one in enumerate(solves):
        _export([one], one.out, format, rig, lambda done, k=k: told((k + done) * share))
    if len(solves) > 1:
        with write_atomically(out) as target, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for one in solves:
                archive.write(one.out, one.name)


def _export(
    solves: Sequence[SolveExport], out: Path, format: str, rig: Path | None, progress: Progress
) -> None:
    names: set[str] = set()
    takes = []
    for one in solves:
        name = one.options.take_name
        if len(solves) > 1 and name in names:
            name = one.name.rpartition("/")[0] + "_" + one.out.stem
        names.add(name)
        takes.append((Poses.load(one.poses), replace(one.options, take_name=name)))
    if rig is None:
        export_takes(takes, out, format, progress=progress)
    else:
        from studio.engine.animation.retarget.onto import export_onto, open_rig  # not when the server starts

        export_onto(takes, out, format, open_rig(rig), progress=progress)
