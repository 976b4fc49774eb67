"""`studio export`: a solve as a file for other programs."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.commands.characters.robot import add_sessions
from studio.commands.common import add_command, add_take, progress_bar

if TYPE_CHECKING:
    from studio.engine.animation.export import ExportOptions
    from studio.engine.animation.retarget.onto import Onto
    from studio.take.folder.take import Take
    from studio.take.library.exports.solve_export import ToExport

_TEXT = """\
Write a solve as a file for other programs.

FBX (with cubic keys), BVH, GLB and USD hold a skeleton with keys; C3D, TRC, CSV and npz hold points. mkv holds
one camera's recorded depth, as an Azure Kinect recording; no solve is needed.
OTIO is a timeline with the take as a clip at its timecode.
Several performers make a file each, which begin at one instant, or with --together one file (FBX, GLB, USD).
The default of --solve is finish, studio, live, or the first by name.
docs/export.md explains the options."""

_OF_SOLVES = (
    "performer", "together", "target", "root_motion", "rotation_order", "unit", "interpolation", "solve", "also",
    "mesh", "rig", "mapping", "fps", "key_error_cm", "start", "end", "take_name", "timecode", "timecode_rate",
    "part_from", "part_to", "smooth_hz", "loop",
    "foot_lock",
)  # fmt: skip
"""Options of solves, which do not apply to depth."""

_RATES = (
    "23.976", "24", "25", "29.97df", "29.97", "30", "47.952", "48", "50", "59.94df", "59.94", "60",
)  # fmt: skip


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "export", run, _TEXT)
    add_take(parser)
    add = parser.add_argument
    formats = ("fbx", "bvh", "glb", "c3d", "trc", "csv", "npz", "usd", "otio", "mkv")
    add("--format", required=True, choices=formats, help="kind of file")
    add("--out", metavar="FILE", type=Path, required=True, help="the file to write")
    add("--solve", metavar="NAME", help="the solve (default: see above)")
    add("--performer", metavar="NAME",
        help="of a solve of several performers only this one (default: each, NAME added to the file's)")  # fmt: skip
    add(
        "--together",
        action="store_true",
        help="all performers in one file, in stage coordinates (FBX, GLB, USD)",
    )
    add("--prop", metavar="NAME", action="append", default=[],
        help="a rigid body of another system, as a skeleton of its own; with --together beside the performers; "
        "may be given again")  # fmt: skip
    add("--camera", metavar="NAME", help="camera of the depth (mkv; required if several cameras have depth)")
    add("--also", metavar="TAKE", type=Path, action="append", default=[],
        help="another take in the same file, as a further animation (FBX); may be given again")  # fmt: skip
    skeleton = parser.add_argument_group("skeleton")
    add = skeleton.add_argument
    add("--target", choices=("humanik", "mixamo", "unreal", "vrm"), default="humanik",
        help="names, bones and axes of the skeleton")  # fmt: skip
    add(
        "--root-motion",
        choices=("hips", "root", "in-place"),
        default="hips",
        help="carrier of the path",
    )
    add(
        "--mesh",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="with a skinned body (default in GLB)",
    )
    add("--rotation-order", choices=("ZXY", "ZYX", "YZX", "XZY", "YXZ", "XYZ"), default="ZXY", help="of BVH")
    add("--unit", choices=("mm", "cm", "m", "in"), default="cm", help="of BVH")
    add("--rig", metavar="FILE", type=Path, help="onto the skeleton of this GLB, FBX or BVH file")
    add("--mapping", metavar="FILE", type=Path,
        help="roles of the rig's bones (default: the table beside it, else by name)")  # fmt: skip
    robots = parser.add_argument_group("robots")
    add = robots.add_argument
    add(
        "--robot",
        metavar="NAME",
        help="the motion of a kept robot that follows the performer (CSV, npz); see `studio robot`",
    )
    add(
        "--balance",
        action="store_true",
        help="keep the robot's centre of mass over its feet while they stand",
    )
    add(
        "--keep-pose",
        action="store_true",
        help="do not have the robot give way in pose where its torques are beyond their limits",
    )
    add_sessions(robots)
    keys = parser.add_argument_group("keys")
    add = keys.add_argument
    add("--fps", metavar="F", type=float, help="frames per second (default: the solve's)")
    add("--interpolation", choices=("cubic", "linear", "constant"), default="cubic",
        help="between keys, in FBX and GLB")  # fmt: skip
    add("--key-error-cm", metavar="CM", type=float,
        help="remove keys while no joint moves by more (FBX; default: a key per frame)")  # fmt: skip
    add("--start", metavar="S", type=float, help="begin this many seconds into the solve")
    add("--end", metavar="S", type=float, help="end this many seconds into the solve")
    add("--take-name", metavar="NAME", help="name of the animation (default: the take's)")
    add(
        "--timecode",
        metavar="TIME",
        help="of the first frame, hh:mm:ss:ff, or `take`: the take's own (FBX, BVH, USD, C3D, CSV, npz, OTIO)",
    )
    add(
        "--timecode-rate",
        metavar="RATE",
        choices=_RATES,
        help="of --timecode (default: the file's frame rate)",
    )
    add("--from", metavar="TIME", dest="part_from", help="begin at this timecode of the take")
    add("--to", metavar="TIME", dest="part_to", help="end at this timecode of the take")
    clean = parser.add_argument_group("clean-up")
    add = clean.add_argument
    add("--smooth-hz", metavar="HZ", type=float, help="low-pass filter with this cut-off, without lag")
    add("--loop", action="store_true", help="cut the best loop, and blend its end into its start")
    add("--foot-lock", action="store_true", help="hold standing feet still")
    parser.set_defaults(usual={option: parser.get_default(option) for option in _OF_SOLVES})


def run(args: argparse.Namespace) -> int:
    from studio.engine.animation.export import export_takes
    from studio.engine.animation.retarget.onto import export_onto
    from studio.take.folder.take import Take
    from studio.take.library.exports.solve_export import named_file

    if args.robot is not None or args.balance or args.keep_pose:
        return _export_robot(args)
    if args.format == "mkv" or args.camera is not None:
        return _export_depth(args)
    onto = _rig(args)
    takes = [Take.open(path) for path in (args.take, *args.also)]
    if args.prop and not args.together:
        return _export_props(args, takes[0])
    performers = [_performers(args, take) for take in takes]
    if args.together and (performers[0][0][0].name or args.prop):
        return _export_scene(args, performers)
    for number, (one, solve) in enumerate(performers[0]):
        alone = args.performer is not None or not one.name
        out = args.out if alone else named_file(args.out, one.name)
        beside = [(one, solve), *(mine[min(number, len(mine) - 1)] for mine in performers[1:])]
        told = [f"solve {name}, {each.poses.frame_count} frames" for each, name in beside]
        with progress_bar("Exporting") as progress:
            poses = [(each.poses, each.options) for each, _ in beside]
            if onto is None:
                export_takes(poses, out, args.format, progress=progress)
            else:
                export_onto(poses, out, args.format, onto, progress=progress)
        print(f"{out}: {'; '.join(told)}, {out.stat().st_size / 1e6:.1f} MB")
    return 0


def _performers(args: argparse.Namespace, take: "Take") -> "list[tuple[ToExport, str]]":
    """Return the performers of a take to export, each with the name of the solve."""
    from studio.library import choose_solve
    from studio.take.library.exports.solve_export import to_export
    from studio.take.timecode.wish import TimecodeWish

    solve = choose_solve(take.solve_names(), args.solve, str(take.path))
    wish = TimecodeWish(args.timecode, args.timecode_rate, args.part_from, args.part_to)
    mine = to_export(take, solve, _options(args, take), args.format, args.performer, wish)
    return [(one, solve) for one in mine]


def _export_scene(args: argparse.Namespace, performers: "list[list[tuple[ToExport, str]]]") -> int:
    """Write all performers of the one take to one file."""
    from studio.engine.animation.export import export_scene
    from studio.take.folder.take import Take
    from studio.take.library.exports.prop_export import props_to_export
    from studio.take.library.exports.solve_export import check_scene

    check_scene(len(performers), args.rig)
    mine = [one for one, _ in performers[0]]
    props = props_to_export(
        Take.open(args.take), performers[0][0][1], args.prop, mine[0].options, args.format
    )
    scene = [(one.name or "performer", one.poses, one.options) for one in (*mine, *props)]
    with progress_bar("Exporting") as progress:
        export_scene(scene, args.out, args.format, progress=progress)
    names, solve = ", ".join(name for name, _, _ in scene), performers[0][0][1]
    frames = max(poses.frame_count for _, poses, _ in scene)
    print(f"{args.out}: solve {solve}, {names}, {frames} frames, {args.out.stat().st_size / 1e6:.1f} MB")
    return 0


_OF_PROPS = frozenset(
    {"solve", "rotation_order", "unit", "interpolation", "fps", "key_error_cm", "start", "end", "smooth_hz"}
)
"""Options of solves that also apply to a prop."""


def _export_props(args: argparse.Namespace, take: "Take") -> int:
    """Write each prop to a file of its own."""
    from studio.library import choose_solve
    from studio.take.library.exports.prop_export import export_prop
    from studio.take.library.exports.solve_export import named_file

    _refuse_options(args, _OF_PROPS, "a prop")
    solve = choose_solve(take.solve_names(), args.solve, str(take.path))
    for name in args.prop:
        out = args.out if len(args.prop) == 1 else named_file(args.out, name)
        count = export_prop(take, solve, name, out, args.format, _options(args, take))
        print(f"{out}: prop {name}, {count} frames, {out.stat().st_size / 1e6:.1f} MB")
    return 0


_OF_ROBOTS = frozenset({"solve", "performer", "fps", "start", "end", "smooth_hz"})
"""Options of solves that also apply to a robot's motion."""


def _export_robot(args: argparse.Namespace) -> int:
    from studio.engine.animation.export import ExportOptions
    from studio.engine.base.errors import SettingsError
    from studio.engine.robots.files import FOLDER
    from studio.engine.robots.motion import check_format
    from studio.library import choose_solve
    from studio.take.folder.take import Take
    from studio.take.library.exports.robot_export import export_robot

    if args.robot is None:
        raise SettingsError(
            "export.balance_without_robot", "--balance and --keep-pose go with --robot; name the robot too"
        )
    check_format(args.format)
    _refuse_options(args, _OF_ROBOTS, "a robot's motion")
    take = Take.open(args.take)
    solve = choose_solve(take.solve_names(), args.solve, str(take.path))
    options = ExportOptions(fps=args.fps, start_s=args.start, end_s=args.end, smooth_hz=args.smooth_hz)
    with progress_bar("Retargeting") as progress:
        made = export_robot(
            take, solve, args.sessions / FOLDER, args.robot, args.out, args.format, options,
            balance=args.balance, give_way=not args.keep_pose, performer=args.performer, progress=progress,
        )  # fmt: skip
    for one in made:
        print(
            f"{one.path}: solve {solve}, robot {args.robot}, {one.frame_count} frames, {one.frames_per_second:g} Hz",
            *one.told,
            sep="\n",
        )
    return 0


def _refuse_options(args: argparse.Namespace, allowed: frozenset[str], what: str) -> None:
    """Refuse options of solves that were given but do not apply."""
    from studio.engine.base.errors import SettingsError

    for option in _OF_SOLVES:
        value = getattr(args, option)
        if option not in allowed and value not in (args.usual[option], None, False, []):
            raise SettingsError(
                "export.not_for",
                "{option}={value}: does not apply to {what}; leave it out",
                option=option,
                value=value,
                what=what,
            )


def _export_depth(args: argparse.Namespace) -> int:
    from studio.engine.base.errors import SettingsError
    from studio.take.folder.take import Take
    from studio.take.library.exports.depth_export import export_depth

    if args.format != "mkv":
        raise SettingsError(
            "export.camera_only_mkv",
            "camera={camera}: goes with --format mkv; leave it out for {format}",
            camera=args.camera,
            format=args.format,
        )
    _refuse_options(args, frozenset(), "mkv, which holds depth as it was recorded")
    with progress_bar("Exporting") as progress:
        camera, count = export_depth(Take.open(args.take), args.out, args.camera, progress=progress)
    print(f"{args.out}: {count} depth images of {camera}, {args.out.stat().st_size / 1e6:.1f} MB")
    return 0


def _rig(args: argparse.Namespace) -> "Onto | None":
    """Return the rig to export onto, None for the performer's own skeleton."""
    from studio.engine.animation.retarget.onto import open_rig
    from studio.engine.base.errors import SettingsError

    if args.rig is not None:
        return open_rig(args.rig, args.mapping)
    if args.mapping is not None:
        raise SettingsError(
            "export.mapping_without_rig",
            "mapping={mapping}: goes with --rig; give the rig's file too",
            mapping=args.mapping,
        )
    return None


def _options(args: argparse.Namespace, take: "Take") -> "ExportOptions":
    from studio.engine.animation.export import ExportOptions

    name = args.take_name or take.path.resolve().name
    return ExportOptions(
        fps=args.fps,
        interpolation=args.interpolation,
        target=args.target,
        root_motion=args.root_motion,
        mesh=args.mesh,
        start_s=args.start,
        end_s=args.end,
        rotation_order=args.rotation_order,
        unit=args.unit,
        key_error_cm=args.key_error_cm,
        take_name=name,
        smooth_hz=args.smooth_hz,
        loop=args.loop,
        foot_lock=args.foot_lock,
    )
