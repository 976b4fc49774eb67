"""`studio evaluate`: the figures of a take's solves against a reference."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.commands.characters.robot import add_sessions
from studio.commands.common import add_command, add_json, add_take, figure, progress_bar, table, write_result

if TYPE_CHECKING:
    from studio.engine.metrics.results import Evaluation
    from studio.take.folder.references import HowAligned
    from studio.take.folder.take import Take

_TEXT = """\
Measure a take's solves against a reference motion.

The reference is a CSV (time_s, then <joint>_x,<joint>_y,<joint>_z per joint, metres), a BVH, FBX, GLB, C3D or TRC,
the poses.npz of another solve, or a table of rigid targets (.txt). Markers and targets lie off the joints, so
constant offsets are fitted and reported. One transform aligns the take (--align) and is reported; the calibration
part at its beginning does not count. A reference from another system has its own clock; --align-time estimates its
offset and drift. Foot slide is measured in the reference's stances and in the solve's own. Clean-up is the number of
errors that an animator would correct; --edit-list prints them with the time since the performance began, as in the
replay (--json has stage times). --report writes all of it as one HTML file, with curves, worst frames and the effect
of each solve's switches relative to the first one named.

--robot measures a robot's motion instead: retargeted as a whole take, with balance, live, and frame by frame as other
tools do (docs/robots.md). It says which joints need more torque than their limits, how far beyond, and when.

Several performers have a reference each, such as --reference performer_1=A.csv --reference performer_2=B.csv. One
transform aligns all of them, and the figures say how often a performer became another one."""

_COLUMNS = {
    "mpjpe_mm": ("MPJPE mm", 1),
    "mpjpe_root_aligned_mm": ("rooted mm", 1),
    "rms_mm": ("RMS mm", 1),
    "pck_50mm": ("within 50 mm", 3),
    "pck_150mm": ("within 150 mm", 3),
    "joint_angle_error_deg": ("joint angles deg", 1),
    "flexion_error_deg": ("flexions deg", 1),
    "acceleration_error_m_s2": ("accel m/s2", 1),
    "latency_ms": ("lag ms", 1),
    "absolute_difference_cm": ("abs.diff cm", 2),
    "shortest_distance_cm": ("shortest cm", 2),
    "nearest_sample_cm": ("nearest sample cm", 2),
    "spike_difference": ("spike difference", 2),
    "deviations": ("deviations", 2),
    "jerk_m_s3": ("jerk m/s3", 0),
    "reference_jerk_m_s3": ("  of the reference", 0),
    "spectral_arc_length": ("spectral arc", 2),
    "reference_spectral_arc_length": ("  of the reference", 2),
    "foot_slide_cm_s": ("slide in reference's stance cm/s", 1),
    "reference_foot_slide_cm_s": ("  of the reference", 1),
    "own_stance_foot_slide_cm_s": ("slide in its own stance cm/s", 1),
    "foot_height_cm": ("foot height cm", 1),
    "contact_precision": ("contacts right", 2),
    "contact_recall": ("contacts found", 2),
    "bone_length_sd_mm": ("bones mm", 1),
    "unseen_share": ("unseen", 3),
    "uncertainty_coverage": ("in 90 % ball", 2),
    "uncertainty_median_ratio": ("ball/error", 2),
    "cleanup_events_per_min": ("clean-up against reference /min", 1),
    "frames": ("frames", 0),
}


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "evaluate", run, _TEXT)
    add_take(parser)
    parser.add_argument(
        "--reference",
        metavar="[PERFORMER=]FILE",
        action="append",
        default=[],
        help="CSV, BVH, C3D, TRC, ... to measure against; of a solve of several performers one each",
    )
    parser.add_argument(
        "--solve",
        metavar="NAME",
        action="extend",
        nargs="+",
        default=[],
        help="solves to measure (default: all)",
    )
    parser.add_argument(
        "--align-time", action="store_true", help="the reference has its own clock: align it in time too"
    )
    parser.add_argument(
        "--align",
        choices=("rigid", "similarity"),
        default="rigid",
        help="align place and direction, or size too (default: rigid)",
    )
    parser.add_argument("--edit-list", action="store_true", help="print every clean-up event")
    parser.add_argument(
        "--unit-m",
        metavar="M",
        type=float,
        help="metres per unit of a BVH reference (default: by a height of 1.75 m)",
    )
    parser.add_argument(
        "--robot", metavar="NAME", help="instead of a reference: how well this kept robot follows the solves"
    )
    add_sessions(parser)
    add_json(parser)
    parser.add_argument(
        "--report", metavar="FILE.html", type=Path, help="write a report with plots and pictures"
    )
    parser.add_argument(
        "--language", choices=("en", "fr"), default="en", help="of the report: en (default) or fr"
    )


def run(args: argparse.Namespace) -> int:
    from studio.engine.base.errors import SettingsError
    from studio.engine.metrics.reference.reference import read_reference
    from studio.engine.model.poses import Poses
    from studio.library import choose_solve, no_solve
    from studio.review.report.evaluation_tables import aligned_away
    from studio.review.report.take_report import take_report, write_report
    from studio.review.report.words import Words
    from studio.take.folder.evaluating import evaluate_solves
    from studio.take.folder.references import HowAligned
    from studio.take.folder.take import POSES, Take

    if not args.reference and args.robot is None:
        raise SettingsError("evaluate.no_reference", "give --reference FILE, or --robot NAME")
    take = Take.open(args.take)
    if args.robot is not None:
        return _of_robot(args, take)
    available = take.solve_names()
    names = [choose_solve(available, name, str(take.path)) for name in dict.fromkeys(args.solve)] or available
    if not names:
        raise no_solve(str(take.path))
    how = HowAligned(args.align_time, args.align, args.unit_m)
    given = _named(args.reference)
    if "" not in given:
        return _of_performers(args, take, given, names, how)
    reference = read_reference(given[""], unit_m=args.unit_m)
    with progress_bar("evaluate") as progress:
        solves = evaluate_solves(take, reference, names, how, progress=progress)
    write_result(args, {"solves": solves})
    if args.report is not None:
        write_report(args.report, take_report(take, reference, solves, Words(args.language)))
    print(summary(solves))
    for name, figures in solves.items():
        print(f"aligned away for {name}: {aligned_away(figures)}")
    if args.edit_list:
        for name, figures in solves.items():
            begins_s = Poses.load(take.performer_folder(name) / POSES).begins_s
            print(edit_list(name, figures, begins_s))
    return 0


def _of_robot(args: argparse.Namespace, take: "Take") -> int:
    """Print how well a robot follows the performers of the solves, in each way."""
    from studio.engine.robots.comparing import compare_ways, ways_table
    from studio.engine.robots.files import FOLDER, load_robot
    from studio.engine.robots.strain import strain_text
    from studio.library import choose_solve
    from studio.take.folder.solved import solved_performers

    robot = load_robot(args.sessions / FOLDER, args.robot)
    wanted = list(dict.fromkeys(args.solve)) or [None]
    found: dict[str, Any] = {}
    for name in wanted:
        solve = choose_solve(take.solve_names(), name, str(take.path))
        for one in solved_performers(take, solve):
            title = f"{solve}, {one.name}" if one.name else solve
            with progress_bar("evaluate") as progress:
                ways = compare_ways(robot, one.poses, progress=progress or (lambda share: None))
            found[title] = {way: figures.as_dict() for way, figures in ways.items()}
            print(f"{title}, robot {robot.name}:\n{table(ways_table(ways))}")
            if ways["whole take"].torque_share is not None:
                print(f"whole take: {strain_text(ways['whole take'].strained)}")
    write_result(args, {"robot": robot.name, "solves": found})
    return 0


def _named(given: list[str]) -> dict[str, Path]:
    """Return the reference files by performer; the name "" stands for the only one.

    Raises:
        SettingsError: several files, not all of them with a name of their own.
    """
    from studio.engine.base.errors import SettingsError

    found: dict[str, Path] = {}
    for text in given:
        name, equals, file = text.partition("=")
        named = bool(equals) and not Path(text).exists() and "/" not in name
        found[name if named else ""] = Path(file if named else text)
    if len(found) < len(given) or ("" in found and len(found) > 1):
        raise SettingsError(
            "evaluate.references",
            "--reference {given}: several references need a performer's name each, such as performer_1=FILE",
            given=" ".join(given),
        )
    return found


def _of_performers(
    args: argparse.Namespace, take: "Take", files: dict[str, Path], names: list[str], how: "HowAligned"
) -> int:
    from studio.engine.metrics.reference.reference import read_reference
    from studio.engine.model.poses import Poses
    from studio.review.report.take_report import several_report, write_report
    from studio.review.report.words import Words
    from studio.take.folder.evaluating import evaluate_performers
    from studio.take.folder.take import POSES

    references = {name: read_reference(file, unit_m=args.unit_m) for name, file in files.items()}
    with progress_bar("evaluate") as progress:
        solves = evaluate_performers(take, references, names, how, progress=progress)
    write_result(args, {"solves": solves})
    if args.report is not None:
        write_report(args.report, several_report(take, references, solves, Words(args.language)))
    for solve, figures in solves.items():
        print(f"{solve}:\n{summary(figures['performers'])}")
        print(
            f"became another one {figures['identity_switches']} times; "
            f"{figures['missed_percent']:.1f} % of frames missed, "
            f"{figures['undecided_percent']:.1f} % undecided"
        )
        for performer, own in figures["performers"].items() if args.edit_list else ():
            begins_s = Poses.load(take.performer_folder(solve, performer) / POSES).begins_s
            print(edit_list(f"{performer} in {solve}", own, begins_s))
    return 0


def summary(solves: Mapping[str, "Evaluation"]) -> str:
    """The figures as tables: one line per figure and a column per solve, then the joints."""
    rows = [["", *solves]]
    rows.append(["joints", *(str(len(figures["matched_joints"])) for figures in solves.values())])
    rows += [
        [title, *(figure(figures[key], digits) for figures in solves.values())]
        for key, (title, digits) in _COLUMNS.items()
    ]
    rows += [
        [
            f"  {kind.replace('_', ' ')}",
            *(figure((f["cleanup_counts"] or {}).get(kind), 0) for f in solves.values()),
        ]
        for kind in dict.fromkeys(k for figures in solves.values() for k in figures["cleanup_counts"] or {})
    ]
    joints = dict.fromkeys(joint for figures in solves.values() for joint in figures["per_joint_mm"])
    rows += [
        [f"{joint} mm", *(figure(figures["per_joint_mm"].get(joint)) for figures in solves.values())]
        for joint in joints
    ]
    return table(rows)


def edit_list(name: str, figures: "Evaluation", begins_s: float) -> str:
    """A solve's clean-up events, one line each; times count from the stage time `begins_s`, as the replay's do."""
    events = figures["cleanup_events"]
    if not events:
        return f"clean-up of {name}: {'not measured' if events is None else 'nothing'}"
    rows = [
        [
            event["kind"].replace("_", " "),
            event["joint"],
            f"{event['start_s'] - begins_s:.2f} s",
            f"{event['end_s'] - begins_s:.2f} s",
            f"{event['size']:.1f} {event['unit']}",
            event["detail"],
        ]
        for event in events
    ]
    since = f"time since the performance began, at stage time {begins_s:.2f} s"
    return f"clean-up of {name} ({since}):\n{table(rows)}"
