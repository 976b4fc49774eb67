"""`studio export`: a solve as a file for other programs."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.commands.common import add_command, add_take, progress_bar

if TYPE_CHECKING:
    from studio.engine.animation.export import ExportOptions
    from studio.engine.animation.retarget.onto import Onto
    from studio.engine.model.poses import Poses
    from studio.take.folder.take import Take

_TEXT = """\
Write a solve as a file for other programs.

FBX (with cubic keys), BVH, GLB and USD hold a skeleton with keys; C3D, TRC, CSV and npz hold points. mkv holds
one camera's recorded depth, as an Azure Kinect recording; no solve is needed.
The default of --solve is finish, studio, live, or the first by name.
docs/export.md explains the options."""

_OF_SOLVES = (
    "performer", "target", "root_motion", "rotation_order", "unit", "interpolation", "solve", "also", "mesh", "rig",
    "mapping", "fps", "key_error_cm", "start", "end", "take_name", "timecode", "smooth_hz", "loop", "foot_lock",
)  # fmt: skip
"""Options of solves, which do not apply to depth."""
_TIMECODE_HZ = 60
"""Frames a second of a take's timecode."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "export", run, _TEXT)
    add_take(parser)
    add = parser.add_argument
    formats = ("fbx", "bvh", "glb", "c3d", "trc", "csv", "npz", "usd", "mkv")
    add("--format", required=True, choices=formats, help="kind of file")
    add("--out", metavar="FILE", type=Path, required=True, help="the file to write")
    add("--solve", metavar="NAME", help="the solve (default: see above)")
    add("--performer", metavar="NAME",
        help="of a solve of several performers only this one (default: each, NAME added to the file's)")  # fmt: skip
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
        help="keys begin at this time of day, hh:mm:ss:ff, or `take`: the take's (FBX)",
    )
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

    if args.format == "mkv" or args.camera is not None:
        return _export_depth(args)
    onto = _rig(args)
    for performer, out in _outs(args):
        takes, told = [], []
        for path in (args.take, *args.also):
            take = Take.open(path)
            poses, name = load_solve(take, args.solve, performer)
            takes.append((poses, _options(args, take, poses)))
            told.append(f"solve {name}, {poses.frame_count} frames")
        with progress_bar("Exporting") as progress:
            if onto is None:
                export_takes(takes, out, args.format, progress=progress)
            else:
                export_onto(takes, out, args.format, onto, progress=progress)
        print(f"{out}: {'; '.join(told)}, {out.stat().st_size / 1e6:.1f} MB")
    return 0


def _outs(args: argparse.Namespace) -> "list[tuple[str | None, Path]]":
    """Return the performers to export, None for a solve of one, each with its file."""
    from studio.library import choose_solve
    from studio.take.folder.take import Take

    take = Take.open(args.take)
    names = take.performer_names(choose_solve(take.solve_names(), args.solve, str(take.path)))
    if args.performer is not None or not names:
        return [(args.performer, args.out)]
    return [(name, args.out.with_name(f"{args.out.stem}-{name}{args.out.suffix}")) for name in names]


def _export_depth(args: argparse.Namespace) -> int:
    from studio.engine.base.errors import SettingsError
    from studio.take.folder.take import Take
    from studio.take.library.depth_export import export_depth

    if args.format != "mkv":
        raise SettingsError(
            "export.camera_only_mkv",
            "camera={camera}: goes with --format mkv; leave it out for {format}",
            camera=args.camera,
            format=args.format,
        )
    for option in _OF_SOLVES:
        value = getattr(args, option)
        if value not in (args.usual[option], None, False, []):
            raise SettingsError(
                "export.not_for_mkv",
                "{option}={value}: mkv holds depth as it was recorded; leave it out",
                option=option,
                value=value,
            )
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


def load_solve(take: "Take", wanted: str | None, performer: str | None = None) -> "tuple[Poses, str]":
    """Return the poses of a take's solve, and its name; of several performers the first, where none is named.

    Raises:
        TakeError: the take has no solve of that name, or none at all, or it has no such performer.
    """
    from studio.engine.model.poses import Poses
    from studio.library import choose_solve
    from studio.take.folder.take import POSES

    name = choose_solve(take.solve_names(), wanted, str(take.path))
    return Poses.load(take.performer_folder(name, performer) / POSES), name


def _options(args: argparse.Namespace, take: "Take", poses: "Poses") -> "ExportOptions":
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
        timecode=_timecode(args.timecode, take, args.fps or poses.frames_per_second),
        smooth_hz=args.smooth_hz,
        loop=args.loop,
        foot_lock=args.foot_lock,
    )


def _timecode(wanted: str | None, take: "Take", fps: float) -> str | None:
    """Return the timecode, or that of the take if asked for, at the frames of the export."""
    from studio.engine.base.errors import SettingsError

    if wanted != "take":
        return wanted
    known = take.meta.get("timecode")
    if known is None:
        raise SettingsError(
            "export.take_no_timecode",
            "timecode=take: take {take} has none; give it as hh:mm:ss:ff",
            take=take.path,
        )
    whole, _, frames = known.rpartition(":")
    return f"{whole}:{int(int(frames) * round(fps) / _TIMECODE_HZ):02d}"
