"""Export of solves for other programs: one performer or several, one file each or together."""

import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.clip.together import on_one_clock
from studio.engine.animation.export import export_scene, export_takes, exporter_of
from studio.engine.base.errors import SettingsError
from studio.engine.base.files import write_atomically
from studio.engine.model.poses import Poses
from studio.take.folder.names import safe_name
from studio.take.folder.performers import performer_by_name
from studio.take.folder.solved import solved_performers
from studio.take.folder.take import Take
from studio.take.timecode.wish import TimecodeWish

Progress = Callable[[float], None]


@dataclass(frozen=True)
class SolveExport:
    """One solve of a take, its output file, the options, and its name in an archive.

    `performer`: only this one of several; None = all. `timecode`: the requested timecode; None = none.
    """

    take: Take
    solve: str
    out: Path
    options: ExportOptions
    name: str
    performer: str | None = None
    timecode: TimecodeWish | None = None


@dataclass(frozen=True)
class ToExport:
    """The poses of one performer, ready to be written; `name` is empty for a single performer."""

    name: str
    poses: Poses
    options: ExportOptions


def export_solves(
    solves: Sequence[SolveExport],
    out: Path,
    format: str,
    rig: Path | None = None,
    *,
    together: bool = False,
    progress: Progress | None = None,
) -> None:
    """Export solves: one file to `out`, several to an archive at `out`, or `together` into one file at `out`.

    Each performer of a solve of several gets a file with their name. With `together`, the performers of one solve
    become a scene, and several solves the takes of one file.

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
    if together:
        _export_together(solves, out, format, rig, told)
        return
    share = 1.0 / len(solves)
    made: list[tuple[Path, str]] = []
    for k, one in enumerate(solves):
        mine = to_export(one.take, one.solve, one.options, format, one.performer, one.timecode)
        for i, performer in enumerate(mine):
            file = named_file(one.out, performer.name)
            if len(solves) == 1 and one.performer is not None:
                file = out
            before, each = share * (k + i / len(mine)), share / len(mine)

            def part(done: float, before: float = before, each: float = each) -> None:
                told(before + done * each)

            _export([(performer.poses, performer.options)], file, format, rig, part)
            made.append((file, f"{one.name.rpartition('/')[0]}/{file.name}"))
    if made != [(out, made[0][1])]:
        archive_of(made, out)


def archive_of(files: Sequence[tuple[Path, str]], out: Path) -> None:
    """Write files, each with its name in the archive, to an archive at `out`, atomically."""
    with write_atomically(out) as target, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for file, name in files:
            archive.write(file, name)


def to_export(
    take: Take,
    solve: str,
    options: ExportOptions,
    format: str,
    only: str | None = None,
    timecode: TimecodeWish | None = None,
) -> list[ToExport]:
    """Return the performers of a solve for export, each from the first frame of any to the last frame of any.

    Formats that hold stage times have each performer's own frames instead; there, performers who are not on the
    stage in the exported part are left out.

    Raises:
        TakeError: no performer of the name `only`.
        SettingsError: nobody is on the stage in the part, or the requested timecode does not exist.
        FormatError: there is no such solve, or it is damaged.
    """
    performers = solved_performers(take, solve)
    if timecode is not None:
        begins, ends = zip(
            *((one.poses.begins_s, float(one.poses.time_s[-1])) for one in performers), strict=True
        )
        fps = options.fps or performers[0].poses.frames_per_second
        options = timecode.of(take, options, begins_s=min(begins), ends_s=max(ends), fps=fps)
    if only is not None:
        take.performer_folder(solve, only)  # reports a name that nobody has
    if performers[0].undecided_s is None:
        return [ToExport("", performers[0].poses, options)]
    own_frames = exporter_of(format).stage_times
    poses_of = [one.poses for one in performers]
    if not own_frames:
        poses_of = on_one_clock(poses_of)
    begins_s = min(one.poses.begins_s for one in performers)
    found = []
    for one, poses in zip(performers, poses_of, strict=True):
        if only is not None and performer_by_name(take.meta, only) != one.performer:
            continue
        theirs = _from(options, poses.begins_s - begins_s, float(poses.time_s[-1]) - begins_s)
        if theirs is not None:
            found.append(ToExport(one.name, poses, replace(theirs, undecided_s=one.undecided_s)))
    if not found:
        raise SettingsError(
            "export.nobody",
            "nobody to export is on the stage from {start:g} s on; choose another part or performer",
            start=options.start_s or 0.0,
        )
    return found


def named_file(out: Path, performer: str) -> Path:
    """Return the file of a performer next to a file: `fight.fbx` and Ana give `fight-Ana.fbx`."""
    if not performer:
        return out
    return out.with_name(f"{out.stem}-{safe_name(performer, 'performer')}{out.suffix}")


def _from(options: ExportOptions, late_s: float, until_s: float) -> ExportOptions | None:
    """Return the options of poses that begin later than the part's zero; None where the part lacks them."""
    start_s, end_s = options.start_s, options.end_s
    if (end_s is not None and end_s < late_s) or (start_s is not None and start_s > until_s):
        return None
    return replace(
        options,
        start_s=None if start_s is None else max(start_s - late_s, 0.0),
        end_s=None if end_s is None else end_s - late_s,
    )


def _export_together(
    solves: Sequence[SolveExport], out: Path, format: str, rig: Path | None, progress: Progress
) -> None:
    takes: list[tuple[Poses, ExportOptions]] = []
    names: set[str] = set()
    for one in solves:
        mine = to_export(one.take, one.solve, one.options, format, one.performer, one.timecode)
        if len(mine) > 1:
            check_scene(len(solves), rig)
            scene = [(performer.name, performer.poses, performer.options) for performer in mine]
            export_scene(scene, out, format, progress=progress)
            return
        name = one.options.take_name
        if len(solves) > 1 and name in names:
            name = one.name.rpartition("/")[0] + "_" + one.out.stem
        names.add(name)
        takes.append((mine[0].poses, replace(mine[0].options, take_name=name)))
    _export(takes, out, format, rig, progress)


def check_scene(solves: int, rig: Path | None) -> None:
    """Refuse a scene of several performers with other solves or a rig.

    Raises:
        SettingsError: there are other solves or a rig.
    """
    if solves > 1:
        raise SettingsError(
            "export.scene_of_one",
            "together: the performers of one take make one file; export each take by itself",
        )
    if rig is not None:
        raise SettingsError(
            "export.scene_on_rig",
            "together: a rig holds one performer; export each performer to a file of its own",
        )


def _export(
    takes: Sequence[tuple[Poses, ExportOptions]],
    out: Path,
    format: str,
    rig: Path | None,
    progress: Progress,
) -> None:
    if rig is None:
        export_takes(takes, out, format, progress=progress)
    else:
        from studio.engine.animation.retarget.onto import export_onto, open_rig  # not when the server starts

        export_onto(takes, out, format, open_rig(rig), progress=progress)
