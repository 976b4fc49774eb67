"""The studio for programs: the functions of `import studio` for whole takes.

A take is opened, made or imported, then calibrated, solved with settings, measured and exported. The files are the
same as those of the command line. Single frames go through `studio.Stream` or `studio.Pipeline`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from studio.engine.base.errors import TakeError
from studio.engine.calibration.views.seen.known_lens import KnownLens
from studio.engine.metrics.results import Evaluation
from studio.engine.model.calibration import Calibration
from studio.engine.model.poses import Poses
from studio.engine.model.settings.settings import SolveSettings
from studio.offline.edits.take_parts import BLEND_S, NEAR_S, TakePart
from studio.take.folder.take import POSES, Take

PathText = str | Path
Progress = Callable[[float], None]
"""Receives the share done, 0..1."""

PREFERRED = ("finish", "studio", "live", "imported", "spliced")
"""The default solve: the first of these that the take has."""


def open_take(path: PathText) -> Take:
    """Return the take in a folder.

    Raises:
        TakeError: there is no take, or one of another version.
    """
    return Take.open(Path(path))


def import_take(
    path: PathText,
    out: PathText,
    *,
    unit_m: float | None = None,
    model: PathText | None = None,
    hands: bool = True,
    sync: str | None = None,
    clap_at_s: Mapping[str, float] | None = None,
    progress: Progress | None = None,
) -> Take:
    """Return a new take from another recording or an animation.

    Args:
        path: a file or folder of a kind that `studio import` reads.
        out: folder of the new take; it must not exist.
        unit_m: metres per unit of an animation that has no unit; None = by a height of 1.75 m.
        model: finds the landmarks in videos: `lite`, `full`, `heavy`, or a file; None = `full`.
        hands: also find the hands in videos.
        sync: synchronises videos: `auto`, `audio`, `clap`, `timecode`, `motion`, `none`; None = `auto`.
        clap_at_s: approximate time of a clap in a camera's video [s]; the name "" is for all others.
        progress: receives the share done.

    Raises:
        FormatError: nothing that can be read, or videos that `sync` cannot synchronise.
        TakeError: `out` exists.
    """
    from studio.take.importers import import_recording

    return import_recording(
        Path(path),
        Path(out),
        unit_m=unit_m,
        model=model,
        hands=hands,
        sync=sync,
        clap_at_s=clap_at_s,
        progress=progress,
    )


def simulate(motion: PathText | Sequence[PathText], out: PathText, **options: Any) -> Take:
    """Return a new take of simulated cameras that watch a motion, with the ground truth, `<out>.truth.csv`.

    Args:
        motion: an animation file, or `demo`, the embedded performer; several for as many performers.
        out: folder of the new take; it must not exist.
        options: `cameras`, `sensor`, `tracker`, `seed`, `unit_m`, `rig`, `calibration`, `performer`, `furniture` and
            `progress`, see `studio.simulator.simulate.simulate_take`.

    Raises:
        FormatError: a motion or rig that cannot be used.
        TakeError: `out` exists.
        SettingsError: a bad option.
    """
    from studio.simulator.simulate import simulate_take

    return Take.open(simulate_take(motion, out, **options))


def calibrate(
    take: Take,
    *,
    reference: str | None = None,
    height_m: float | None = None,
    lenses: Mapping[str, KnownLens] | None = None,
    same_lens: bool = False,
    readouts_ms: Mapping[str, float] | None = None,
    board: str | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Return the calibration from a take's frames; it is stored in the take and used from now on.

    Args:
        take: with raw frames.
        reference: the camera whose clock is the stage clock; None = the first.
        height_m: the performer's, without shoes; where no camera sees depth it sets the size of the stage (None =
            1.75 in shoes).
        lenses: known parameters of the lenses of cameras without depth.
        same_lens: all of these cameras with unknown lenses have one focal length.
        readouts_ms: of cameras without depth, the time in which each reads a picture, first row to last [ms].
        board: in the take's videos; sets the size for these cameras and, on the floor, also floor and origin. As for
            `--board`: `charuco:5x7:60:45` (squares and markers in mm) or `apriltag:160`.
        progress: receives the share done.

    Raises:
        CalibrationError: no frames, or a calibration that is refused, with the reasons.
        SettingsError: no such camera.
    """
    from studio.engine.seeing.board import Board
    from studio.offline.board import calibrated_by_board
    from studio.offline.tracking import calibrate_take, keep_calibration

    wanted = None if board is None else Board.parse(board)
    calibration = calibrate_take(
        take,
        reference=reference,
        height_m=height_m,
        lenses=lenses,
        same_lens=same_lens,
        readouts_ms=readouts_ms,
        progress=progress,
    )
    if wanted is not None and not calibration.refused:
        calibration, _ = calibrated_by_board(take, calibration, wanted, height_m=height_m)
    keep_calibration(take, calibration)
    return calibration


def settings(preset: str = "studio", switches: Mapping[str, object] | None = None) -> SolveSettings:
    """Return a preset's settings with some switches changed.

    Args:
        preset: `raw`, `thesis`, `studio` or `finish`.
        switches: values by key, as `--set KEY=VALUE` takes them, such as `{"smoothing": "one_euro:before"}` or
            `{"effectors.head.reach": 0.5}`.

    Raises:
        SettingsError: an unknown preset, key or value; the message lists what is allowed.
    """
    from studio.engine.model.settings.settings import parse_settings

    return parse_settings(preset, [f"{key}={value}" for key, value in (switches or {}).items()])


def solve(
    take: Take,
    using: str | SolveSettings = "studio",
    *,
    name: str | None = None,
    as_live: bool = False,
    edits: bool = True,
    progress: Progress | None = None,
) -> Poses:
    """Return the poses of a take, solved from its raw frames; they are stored as `solves/<name>`.

    With several performers, the first one's are returned; `load_poses` returns those of any.

    Args:
        take: with raw frames and a calibration.
        using: a preset's name, or settings.
        name: of the solve, which replaces one of that name; by default the preset's, `solve` for settings, `as-live`
            for `as_live`.
        as_live: repeat the decisions of the live stage, bit for bit.
        edits: honour the edits of the take.
        progress: receives the share done.

    Raises:
        TakeError: no raw frames.
        CalibrationError: no calibration.
        SettingsError: the take lacks a named camera.
    """
    from studio.offline.replay import solve_take

    chosen = settings(using) if isinstance(using, str) else using
    usual = "as-live" if as_live else using if isinstance(using, str) else "solve"
    folder = solve_take(
        take, chosen, name=name or usual, as_live=as_live, progress=progress, edits=None if edits else ()
    )
    return load_poses(take, folder.name)


def load_poses(take: Take, solve: str | None = None, performer: str | None = None) -> Poses:
    """Return the poses of a take's solve; the default is the first of `PREFERRED`.

    Args:
        take: with solves.
        solve: its name.
        performer: one of `take.performer_names(solve)`, where there are several; None = the first.

    Raises:
        TakeError: the take has no such solve or performer, or no solve at all.
        FormatError: it is damaged.
    """
    name = choose_solve(take.solve_names(), solve, str(take.path))
    return Poses.load(take.performer_folder(name, performer) / POSES)


def evaluate(
    take: Take,
    reference: PathText,
    solves: list[str] | None = None,
    *,
    align_time: bool = False,
    align: str = "rigid",
    unit_m: float | None = None,
    performer: str | None = None,
    progress: Progress | None = None,
) -> dict[str, Evaluation]:
    """Return the figures of a take's solves against a reference, by name of the solve.

    Args:
        take: with solves.
        reference: BVH, C3D, TRC or CSV.
        solves: names; None = all.
        align_time: the reference has its own clock, whose offset and drift are estimated.
        align: `rigid`, or `similarity` (the size too).
        unit_m: metres per unit of a BVH; None = by a height of 1.75 m.
        performer: with several, the performer whose motion the reference has; None = the first one.
        progress: receives the share done.

    Raises:
        TakeError: no such solve or performer.
        FormatError: a reference that cannot be read or shares too little with the solve.
    """
    from studio.engine.metrics.reference.reference import read_reference
    from studio.take.folder.evaluating import evaluate_solves
    from studio.take.folder.references import HowAligned

    available = take.solve_names()
    names = available if solves is None else [choose_solve(available, one, str(take.path)) for one in solves]
    if not names:
        raise no_solve(str(take.path))
    how = HowAligned(align_time, align, unit_m, performer)
    return evaluate_solves(
        take, read_reference(Path(reference), unit_m=unit_m), names, how, progress=progress
    )


def export(
    poses: Poses,
    out: PathText,
    format: str | None = None,
    *,
    progress: Progress | None = None,
    **options: Any,
) -> Path:
    """Write poses as a file for other programs; return its path.

    Args:
        poses: of a solve.
        out: the file; it is replaced.
        format: fbx, bvh, glb, c3d, trc, csv, npz or usd; None = by the file's ending.
        progress: receives the share done.
        options: fields of `studio.ExportOptions`, such as `target="unreal"`, `fps=30.0`, `mesh=True`.

    Raises:
        SettingsError: an unknown format or option.
        NotAvailableError: the format's library is not installed.
    """
    from studio.engine.animation.export import export as write

    out = Path(out)
    write(poses, out, format or out.suffix.lstrip(".").lower(), progress=progress, **options)
    return out


def splice(
    parts: Sequence[TakePart | Take],
    out: PathText,
    *,
    times: int = 1,
    blend_s: float = BLEND_S,
    near_s: float = NEAR_S,
    progress: Progress | None = None,
) -> Take:
    """Return a new take of parts of one performer's solves, one after the other; it remembers them.

    The end of each part is blended into the begin of the next, which is turned and moved onto its path; standing feet
    stay. Times of the new take begin at 0.

    Args:
        parts: in their order; a take stands for its whole solve.
        out: folder of the new take; it must not exist.
        times: number of repetitions of all parts; above 1 makes a loop.
        blend_s: length of each seam, which covers the end of one part and the begin of the next [s].
        near_s: largest shift of each begin, to where it is most like the end before it; 0 = no shift [s].
        progress: receives the share done.

    Raises:
        SettingsError: parts of two performers, a part that is too short, or a value that is not allowed.
        TakeError: a take without solves, no such solve or performer; or `out` exists.
    """
    from studio.offline.edits.splicing import splice_takes

    named: list[TakePart] = []
    for one in parts:
        part = TakePart(one) if isinstance(one, Take) else one
        solve = choose_solve(part.take.solve_names(), part.solve, str(part.take.path))
        named.append(replace(part, solve=solve))
    return splice_takes(named, Path(out), times=times, blend_s=blend_s, near_s=near_s, progress=progress)


def choose_solve(available: list[str], wanted: str | None, take: str) -> str:
    """Return the name of the solve to use: the wanted one, else the first of `PREFERRED`.

    Raises:
        TakeError: the take has no solve of that name, or none at all.
    """
    if wanted is not None and wanted in available:
        return wanted
    if not available:
        raise no_solve(take)
    if wanted is not None:
        raise TakeError(
            "take.no_solve",
            "take {take} has no solve {name!r}; it has: {others}",
            take=take,
            name=wanted,
            others=[*available],
        )
    return next((name for name in PREFERRED if name in available), available[0])


def no_solve(take: str) -> TakeError:
    """Return the error for a take that has no solve."""
    return TakeError("take.not_solved", "take {take} has no solve yet; run `studio solve {take}`", take=take)
