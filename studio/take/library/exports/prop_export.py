"""Props of a take, ready for the exporters: each is its own skeleton at the instants of a solve."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from studio.engine.animation.clip.options import ExportOptions
from studio.engine.animation.export import export_takes, exporter_of
from studio.take.folder.names import safe_name
from studio.take.folder.solved import solved_performers
from studio.take.folder.take import Take
from studio.take.library.exports.solve_export import ToExport
from studio.take.rigid_bodies.kept import take_bodies
from studio.take.rigid_bodies.used import no_such_body, prop_in_hand, stage_bodies


def props_to_export(
    take: Take, solve: str, names: Sequence[str], options: ExportOptions, format: str
) -> list[ToExport]:
    """Return rigid bodies of a take as props, tied to the hands of a solve that hold them.

    Args:
        take: whose bodies.
        solve: of the take.
        names: of the bodies.
        options: of the performers' export; a mesh and a target are not for props.
        format: a key of `EXPORTERS`.

    Raises:
        SettingsError: no such body was received.
        FormatError: a file is damaged.
    """
    if not names:
        return []
    known = take_bodies(take)
    tracks = stage_bodies(take, known).tracks
    performers = solved_performers(take, solve)
    bare = False if "mesh" in exporter_of(format).options else None
    found = []
    for name in names:
        if name not in tracks:
            raise no_such_body(take, name)
        poses = prop_in_hand(safe_name(name, "prop"), tracks[name], known.named(name), performers)
        mine = replace(options, mesh=bare, target="humanik", root_motion="hips", foot_lock=False, loop=False)
        found.append(ToExport(safe_name(name, "prop"), poses, mine))
    return found


def export_prop(
    take: Take,
    solve: str,
    name: str,
    out: Path,
    format: str,
    options: ExportOptions,
    *,
    progress: Callable[[float], None] | None = None,
) -> int:
    """Write a rigid body of a take as its own skeleton; return the number of frames.

    Args and errors as for `props_to_export`; `progress` receives the share done.

    Raises:
        StudioError: the file cannot be written.
    """
    (one,) = props_to_export(take, solve, [name], options, format)
    export_takes([(one.poses, one.options)], out, format, progress=progress)
    return one.poses.frame_count
