"""What the server runs in a worker process to export several solves; imports stay inside."""

import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from studio.engine.export.options import ExportOptions


@dataclass(frozen=True)
class Item:
    """One solve: its `poses.npz`, the file it makes, how, and its name in an archive."""

    poses: Path
    out: Path
    options: ExportOptions
    name: str


def export_items_work(
    items: list[Item],
    format: str,
    rig: Path | None,
    out: Path,
    together: bool,
    *,
    progress: Callable[[float], None],
) -> None:
    """Export solves: each to its own file, packed at `out` where there are several, or `together` into `out`."""
    from studio.engine.files import write_atomically

    if together and len(items) > 1:
        _export(items, out, format, rig, progress)
        return
    share = 1.0 / len(items)
    for k, item in enumerate(items):
        _export([item], item.out, format, rig, lambda done, k=k: progress((k + done) * share))
    if len(items) > 1:
        with write_atomically(out) as target, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for item in items:
                archive.write(item.out, item.name)


def export_depth_work(take: Path, out: Path, camera: str, *, progress: Callable[[float], None]) -> None:
    """Write a camera's depth as it was recorded, as an Azure Kinect recording."""
    from studio.take.depth_export import export_depth
    from studio.take.take import Take

    out.parent.mkdir(parents=True, exist_ok=True)
    export_depth(Take.open(take), out, camera, progress=progress)


def _export(
    items: list[Item], out: Path, format: str, rig: Path | None, progress: Callable[[float], None]
) -> None:
    from studio.engine.export import export_takes
    from studio.engine.poses import Poses
    from studio.engine.retarget.onto import export_onto, open_rig

    names: set[str] = set()
    takes = []
    for item in items:
        name = item.options.take_name
        if len(items) > 1 and name in names:
            name = item.name.rpartition("/")[0] + "_" + item.out.stem
        names.add(name)
        takes.append((Poses.load(item.poses), replace(item.options, take_name=name)))
    if rig is None:
        export_takes(takes, out, format, progress=progress)
    else:
        export_onto(takes, out, format, open_rig(rig), progress=progress)
