"""Finds damage of takes on disk, and repairs the consequences of a crash.

Repaired: unfinished or damaged `raw.mcap`, missing or damaged `take.json`, live poses that did not become a solve,
the mark of a recording whose server is gone, files and folders that a killed program left. Damaged files of the stage
(`stage_files`) are moved aside.
Only reported: damaged calibrations and solves (`calibrate` and `solve` make them again), takes of another version.
"""

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from studio.engine.base.errors import CalibrationError, FormatError, StudioError, TakeError
from studio.engine.base.sentences import system_says
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings
from studio.take.folder.lock import is_held
from studio.take.folder.marker import MARKER, read_marker, remove_marker
from studio.take.folder.new import PARTIAL_MARK
from studio.take.folder.take import Take, TakeVersionError, read_calibration
from studio.take.library.live_solve import save_live_solve
from studio.take.raw.append import scan_raw
from studio.take.raw.frames import RawSummary, inspect_raw
from studio.take.raw.pose_log import PoseLogs, pose_files
from studio.take.upkeep.recovery import TEMPORARY_PREFIX, recover
from studio.take.upkeep.stage_files import check_stage_files


@dataclass(frozen=True)
class Finding:
    """One fault: its place, its description, the action taken or advised, and whether it is repaired."""

    path: Path
    problem: str
    action: str
    repaired: bool


def check_takes(
    sessions_dir: str | Path, *, repair: bool = True, progress: Callable[[float], None] | None = None
) -> list[Finding]:
    """Return the faults of the takes in a folder; repairable ones are repaired, unless `repair` is off.

    Args:
        sessions_dir: a folder of sessions, a session, or a take.
        progress: called with 0..1.

    Raises:
        TakeError: there is no such folder.
    """
    root = Path(sessions_dir)
    if not root.is_dir():
        raise TakeError(
            "take.no_root", "no folder {folder}; give the folder of sessions or of a take", folder=root
        )
    partial, takes = _folders(root)
    findings = [_partial_folder(folder, repair) for folder in partial]
    findings += _check_marker(root, repair)
    damage = [] if _is_take(root) else check_stage_files(root, repair=repair)
    findings += [Finding(one.path, one.problem, one.action, repaired=repair) for one in damage]
    for k, path in enumerate(takes):
        findings += check_take(path, repair=repair)
        if progress is not None:
            progress((k + 1) / len(takes))
    return findings


def check_take(path: Path, *, repair: bool = True) -> list[Finding]:
    """Return the faults of one take; repairable ones are repaired, unless `repair` is off."""
    if (path / "raw.mcap").is_file() and is_held(path / "raw.mcap"):
        return []  # being recorded: unfinished as it should be
    findings = [*_check_recording(path, repair), *_temporary_files(path, repair)]
    try:
        take = Take.open(path)
    except TakeError:
        return findings  # reported by _check_recording already
    return [*findings, *_check_live_poses(take, repair), *_check_calibrations(take), *_check_solves(take)]


def _check_marker(root: Path, repair: bool) -> Iterator[Finding]:
    """Check the mark of a recording whose server ended without warning."""
    if not (root / MARKER).is_file():
        return
    marker = read_marker(root)
    raw = None if marker is None else marker.path(root) / "raw.mcap"
    if raw is not None and raw.is_file() and is_held(raw):
        return  # its server is running
    name = "a take" if marker is None else f"take {marker.session}/{marker.take}"
    if repair:
        remove_marker(root)
    action = "the take is ended as it stands" if repair else "start the studio to go on with it"
    yield Finding(root / MARKER, f"the server ended while {name} was being recorded", action, repaired=repair)


def _check_live_poses(take: Take, repair: bool) -> Iterator[Finding]:
    """Check for live poses that were logged during the recording and did not become a solve."""
    file = next(iter(pose_files(take.path).values()), None)
    if file is None or take.meta["recording"] == "recording":
        return
    problem, again = "the live solve was not saved", f"run `studio solve {take.path} --as-live --name live`"
    if not repair:
        yield Finding(file, problem, f"run `studio doctor {take.path}`", repaired=False)
        return
    try:
        state = scan_raw(take.raw_path)
        if state.settings is None:
            raise TakeError("take.log_no_settings", "the live log does not tell its settings")
        PoseLogs(take.path, ticks=state.ticks).close()
        frames = sum(ranges.count for ranges in state.frames.values())
        count = save_live_solve(take, SolveSettings.from_json(state.settings), frames)
    except (StudioError, OSError) as error:
        yield Finding(file, f"{problem}: {error}", again, repaired=False)
        return
    yield Finding(file, problem, f"made of the {count} poses kept", repaired=True)


def _folders(root: Path) -> tuple[list[Path], list[Path]]:
    """Return folders that a killed import left, and takes, in `root` and two levels below."""
    if _is_take(root):
        return [], [root]
    partial: list[Path] = []
    takes: list[Path] = []
    level = [root]
    for _ in range(2):
        below = sorted(f for folder in level for f in _subfolders(folder))
        partial += [f for f in below if f.name.startswith(".") and PARTIAL_MARK in f.name]
        visible = [f for f in below if not f.name.startswith(".")]
        takes += [f for f in visible if _is_take(f)]
        level = [f for f in visible if not _is_take(f)]
    return [f for f in partial if not is_held(f)], takes


def _subfolders(folder: Path) -> list[Path]:
    try:
        return [f for f in folder.iterdir() if f.is_dir() and not f.is_symlink()]
    except OSError as error:
        raise TakeError(
            "file.unreadable_rights",
            "cannot read {path}: {error}; check the rights",
            path=folder,
            error=system_says(error),
        ) from error


def _is_take(folder: Path) -> bool:
    return (folder / "take.json").is_file() or (folder / "raw.mcap").is_file()


def _partial_folder(folder: Path, repair: bool) -> Finding:
    if repair:
        shutil.rmtree(folder, ignore_errors=True)
    gone = not folder.exists()
    return Finding(
        folder,
        "an import or simulation was killed and left this unfinished folder",
        "removed; run the import or simulation again" if gone else f"delete {folder}, and run it again",
        repaired=gone,
    )


def _check_recording(path: Path, repair: bool) -> Iterator[Finding]:
    """Check take.json and raw.mcap together, because one recovery repairs both."""
    raw = path / "raw.mcap"
    problems: list[str] = []
    take: Take | None = None
    try:
        take = Take.open(path)
    except TakeVersionError as error:
        yield Finding(path / "take.json", str(error), "open it with the version that made it", repaired=False)
        return
    except TakeError as error:
        problems.append(str(error))
    summary = inspect_raw(raw) if raw.is_file() else None
    if summary is not None and not summary.complete:
        problems.append(f"raw.mcap: {summary.problem}")
    elif summary is not None and take is not None and take.meta["recording"] == "recording":
        problems.append("the recording was not ended: raw.mcap is whole, take.json says `recording`")
    elif summary is None and (take is None or not take.solve_names()):
        yield Finding(path, "the take has no raw.mcap and no solve", f"delete {path}", repaired=False)
        return
    if problems:
        yield _recover(path, "; ".join(problems), summary, repair)


def _recover(path: Path, problem: str, summary: RawSummary | None, repair: bool) -> Finding:
    if summary is None:
        action = "take.json cannot be rebuilt without raw.mcap; save what is in solves/, then delete it"
        return Finding(path, problem, action, repaired=False)
    counts = [f"{name} {count}" for name, count in summary.frames.items()]
    counts += [f"{name} {count} depth images" for name, count in summary.depth_frames.items()]
    kept = ", ".join(counts) or "none"
    if not repair:
        return Finding(
            path, problem, f"run `studio doctor {path}`; frames to recover: {kept}", repaired=False
        )
    try:
        recover(path)
    except TakeError as error:
        return Finding(path, problem, str(error), repaired=False)
    return Finding(path, problem, f"recovered, the damaged file kept beside; frames: {kept}", repaired=True)


def _temporary_files(path: Path, repair: bool) -> Iterator[Finding]:
    """Check for temporary files of a program that was killed while it wrote a file or a solve."""
    found = [
        *path.glob(f"{TEMPORARY_PREFIX}*"),
        *path.glob(".take.json.*"),
        *path.glob(".edits.json.*"),
        *path.glob("calibrations/.*.json.*"),
        *path.glob("tracked/.*.npz.*"),
    ]
    for file in sorted([*found, *path.glob(f"solves/.*{PARTIAL_MARK}*"), *path.glob("solves/.*.old-*")]):
        name = file.name[1:].rsplit(".old-", 1)[0]
        lost = ".old-" in file.name and not (file.parent / name).exists()
        if repair:
            _put_back_or_remove(file, file.parent / name if lost else None)
        action = f"{'put back' if lost else 'removed'}" if repair else f"run `studio doctor {path}`"
        yield Finding(file, "a program was killed while it wrote, and left this", action, repaired=repair)


def _put_back_or_remove(file: Path, place: Path | None) -> None:
    if place is not None:
        inner = file / place.name
        (inner if inner.is_dir() else file).rename(place)
    if file.is_dir():
        shutil.rmtree(file, ignore_errors=True)
    else:
        file.unlink(missing_ok=True)


def _check_calibrations(take: Take) -> Iterator[Finding]:
    in_use = take.meta["calibration"]
    numbers = take.calibration_numbers()
    again = f"run `studio calibrate {take.path}`"
    if in_use is not None and in_use not in numbers:
        file = take.calibration_path(in_use)
        yield Finding(
            file, "the calibration in use is missing", f"run `studio calibrate {take.path}`", repaired=False
        )
    for number in numbers:
        file = take.calibration_path(number)
        try:
            read_calibration(file)
        except CalibrationError as error:
            again = (
                f"run `studio calibrate {take.path}`" if number == in_use else f"not in use; delete {file}"
            )
            yield Finding(file, str(error), again, repaired=False)


def _check_solves(take: Take) -> Iterator[Finding]:
    for folder in sorted(f for f in (take.path / "solves").glob("[!.]*") if f.is_dir()):
        again = f"run `studio solve {take.path} --name {folder.name}`, or delete {folder}"
        if not (folder / "poses.npz").is_file():
            yield Finding(folder, "the solve was not finished: it has no poses.npz", again, repaired=False)
            continue
        try:
            Poses.load(folder / "poses.npz")
        except FormatError as error:
            yield Finding(folder / "poses.npz", str(error), again, repaired=False)
