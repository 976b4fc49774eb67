"""What the server runs in worker processes; imports stay inside, so that a process loads what it needs only."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from studio.engine.export.options import ExportOptions


def solve_work(
    path: Path, settings: dict[str, Any], name: str, as_live: bool, *, progress: Callable[[float], None]
) -> None:
    """Solve the take at `path`; `settings` as `SolveSettings.to_json`."""
    from studio.engine.settings import SolveSettings
    from studio.replay import solve_take
    from studio.take.take import Take

    solve_take(
        Take.open(path), SolveSettings.from_json(settings), name=name, as_live=as_live, progress=progress
    )


def draft_work(
    path: Path, settings: dict[str, Any], start_s: float, end_s: float, *, progress: Callable[[float], None]
) -> Any:
    """Return the `Poses` of a part of the take at `path`, from `start_s` to `end_s` of stage time."""
    from studio.engine.settings import SolveSettings
    from studio.first_look import solve_part
    from studio.take.take import Take

    return solve_part(Take.open(path), SolveSettings.from_json(settings), start_s, end_s, progress=progress)


def export_work(poses: Path, out: Path, format: str, options: ExportOptions, rig: Path | None = None) -> None:
    """Export the `poses.npz` to `out`, onto a rig where one is given."""
    from studio.engine.export import export
    from studio.engine.poses import Poses
    from studio.engine.retarget.onto import export_onto, open_rig

    if rig is None:
        export(Poses.load(poses), out, format, options)
    else:
        export_onto([(Poses.load(poses), options)], out, format, open_rig(rig))


def rig_work(rig: Path) -> dict[str, Any]:
    """Return what there is to know of a rig and its mapping."""
    from studio.engine.retarget.facts import rig_facts

    return rig_facts(rig)


def keep_rig_work(data: bytes, path: Path) -> dict[str, Any]:
    """Keep a rig at `path`; return what there is to know of it."""
    from studio.engine.retarget.facts import keep_rig, rig_facts

    keep_rig(data, path)
    return rig_facts(path)


def map_rig_work(rig: Path, bones: dict[str, str | None]) -> dict[str, Any]:
    """Save a rig's mapping where it does; return what there is to know of the rig then."""
    from studio.engine.retarget.facts import rig_facts
    from studio.engine.retarget.files import read_rig
    from studio.engine.retarget.mapping import checked_bones, mapping_of, mapping_path, save_mapping

    opened, named = read_rig(rig), checked_bones(dict(bones), "mapping")
    mapping_of(opened, named)
    save_mapping(mapping_path(rig), opened, named)
    return rig_facts(rig)


def cleanup_work(take: Path, poses: Path, reference: Path | None) -> dict[str, Any]:
    """Return the clean-up of the solve in `poses.npz`, against a reference where there is one."""
    from studio.engine.metrics.cleanup.solve import solve_cleanup
    from studio.engine.metrics.reference import read_reference
    from studio.engine.poses import Poses
    from studio.take.take import Take

    truth = None if reference is None else read_reference(reference)
    return solve_cleanup(Poses.load(poses), truth, start_s=Take.open(take).meta["calibration_s"])


def calibrate_work(path: Path, reference: str | None, *, progress: Callable[[float], None]) -> None:
    """Calibrate the take at `path` from its own frames; a refused calibration is kept and not used.

    Raises:
        CalibrationError: it was refused, with the reasons.
    """
    from studio.take.take import Take
    from studio.tracking import calibrate_take, keep_calibration

    take = Take.open(path)
    keep_calibration(take, calibrate_take(take, reference=reference))


def compare_work(a: Path, b: Path) -> dict[str, Any]:
    """Return how far the solves in two `poses.npz` are apart."""
    from studio.engine.metrics.compare import compare
    from studio.engine.poses import Poses

    return compare(Poses.load(a), Poses.load(b))


def bundle_work(take: Path, out: Path) -> int:
    """Write a take as one file; return its size [bytes]."""
    from studio.take.bundle import write_bundle
    from studio.take.take import Take

    return write_bundle(Take.open(take), out)


def unbundle_work(file: Path, out: Path) -> None:
    """Make a take at `out` of one file."""
    from studio.take.bundle import read_bundle

    read_bundle(file, out)


def bake_work(pairs: list[tuple[list[Path], list[Path], dict[str, Any]]]) -> list[tuple[bytes, bytes]]:
    """Return the animations of blind tests' pairs, given both `poses.npz`, both takes and the pair.

    The character has the proportions of the first take's performer, else of the second's.
    """
    import msgspec

    from studio.blind.bake import bake_pair
    from studio.blind.model import Pair
    from studio.engine.poses import Poses
    from studio.take.take import Take

    baked = []
    for files, takes, value in pairs:
        pair = msgspec.convert(value, Pair)
        opened = [Take.open(path) for path in takes]
        known = [take.calibration().performer for take in opened if take.meta["calibration"] is not None]
        performer = next((one for one in known if one is not None), None)
        first, second = (Poses.load(file) for file in files)
        baked.append(bake_pair((first, second), (pair.a, pair.b), performer, pair.start_s, pair.end_s))
    return baked


def share_work(poses: Path, title: str, subtitle: str, start_s: float | None, end_s: float | None) -> bytes:
    """Return a part of the `poses.npz` as a replay page."""
    from studio.engine.poses import Poses, on_output_joints
    from studio.share.page import replay_page

    return replay_page(
        on_output_joints(Poses.load(poses)), title=title, subtitle=subtitle, start_s=start_s, end_s=end_s
    )


def thumbnails_work(wanted: list[tuple[Path, Path]]) -> list[Path]:
    """Draw the pictures of takes, given the `poses.npz` and the picture of each; return those that were made."""
    import tempfile

    from studio.engine.errors import StudioError
    from studio.engine.poses import Poses
    from studio.render.thumbnail import render_thumbnail

    made = []
    with tempfile.TemporaryDirectory() as folder:
        drawn = Path(folder) / "picture.png"
        for poses, picture in wanted:
            try:
                render_thumbnail(Poses.load(poses), drawn)
                _put(drawn, picture)
            except (StudioError, OSError):
                continue  # damaged: the list says so; or the take was thrown away or renamed meanwhile
            made.append(picture)
    return made


def _put(drawn: Path, picture: Path) -> None:
    """Put a picture into its take, whole or not at all; the folder of a take that is gone is not made again."""
    picture.parent.mkdir(exist_ok=True)
    part = picture.with_suffix(".part")
    part.write_bytes(drawn.read_bytes())
    part.replace(picture)
