"""`studio export`: a solve as a file for other programs."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.commands.common import add_command, add_take, progress_bar

if TYPE_CHECKING:
    from studio.engine.export import ExportOptions
    from studio.engine.poses import Poses
    from studio.engine.retarget.onto import Onto
    from studio.take.take import Take

_TEXT = """\
Write a solve as a file for other programs.

FBX (with cubic keys), BVH, GLB and USD hold a skeleton with keys; C3D, TRC, CSV and npz hold points. mkv holds
one camera's depth as it was recorded, as an Azure Kinect recording; no solve is needed.
Without --solve, the best solve of the take is taken: finish, studio, live, or the first by name.
docs/export.md tells what each option does."""

PREFERRED = ("finish", "studio", "live", "imported")
_OF_SOLVES = (
    "target", "root_motion", "rotation_order", "unit", "interpolation", "solve", "also", "mesh", "rig", "mapping",
    "fps", "key_error_cm", "start", "end", "take_name", "timecode", "smooth_hz", "loop", "foot_lock",
)  # fmt: skip
"""Options of solves: nothing that holds depth has them."""
_TIMECODE_HZ = 60
"""Frames a second of the timecode that a take has."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "export", run, _TEXT)
    add_take(parser)
    add = parser.add_argument
    formats = ("fbx", "bvh", "glb", "c3d", "trc", "csv", "npz", "usd", "mkv")
    add("--format", required=True, choices=formats, help="kind of file")
    add("--out", metavar="FILE", type=Path, required=True, help="the file to write")
    add("--solve", metavar="NAME", help="which solve")
    add("--camera", metavar="NAME", help="whose depth (mkv; needed where several cameras have some)")
    add("--also", metavar="TAKE", type=Path, action="append", default=[],
        help="another take into the same file, as a further animation (FBX); may be given again")  # fmt: skip
    skeleton = parser.add_argument_group("skeleton")
    add = skeleton.add_argument
    add("--target", choices=("humanik", "mixamo", "unreal", "vrm"), default="humanik",
        help="names, bones and axes of the skeleton")  # fmt: skip
    add(
        "--root-motion",
        choices=("hips", "root", "in-place"),
        default="hips",
        help="which bone carries the path",
    )
    add(
        "--mesh",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="with a skinned body (GLB has one)",
    )
    add("--rotation-order", choices=("ZXY", "ZYX", "YZX", "XZY", "YXZ", "XYZ"), default="ZXY", help="of BVH")
    add("--unit", choices=("mm", "cm", "m", "in"), default="cm", help="of BVH")
    add("--rig", metavar="FILE", type=Path, help="onto the skeleton of this GLB, FBX or BVH file")
    add("--mapping", metavar="FILE", type=Path,
        help="which bone of the rig is what (default: the table beside it, else by name)")  # fmt: skip
    keys = parser.add_argument_group("keys")
    add = keys.add_argument
    add("--fps", metavar="F", type=float, help="frames per second (default: the solve's)")
    add("--interpolation", choices=("cubic", "linear", "constant"), default="cubic",
        help="between keys, in FBX and GLB")  # fmt: skip
    add("--key-error-cm", metavar="CM", type=float,
        help="leave out keys as long as no joint moves by more (FBX; default: a key per frame)")  # fmt: skip
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
    add("--smooth-hz", metavar="HZ", type=float, help="take out what is faster, without a delay")
    add("--loop", action="store_true", help="cut the best loop, its end blended into its start")
    add("--foot-lock", action="store_true", help="hold standing feet still")
    parser.set_defaults(usual={option: parser.get_default(option) for option in _OF_SOLVES})


def run(args: argparse.Namespace) -> int:
    from studio.engine.export import export_takes
    from studio.engine.retarget.onto import export_onto
    from studio.take.take import Take

    if args.format == "mkv" or args.camera is not None:
        return _export_depth(args)
    takes, told = [], []
    for path in (args.take, *args.also):
        take = Take.open(path)
        poses, name = load_solve(take, args.solve)
        takes.append((poses, _options(args, take, poses)))
        told.append(f"solve {name}, {poses.frame_count} frames")
    onto = _rig(args)
    with progress_bar("Exporting") as progress:
        if onto is None:
            export_takes(takes, args.out, args.format, progress=progress)
        else:
            export_onto(takes, args.out, args.format, onto, progress=progress)
    print(f"{args.out}: {'; '.join(told)}, {args.out.stat().st_size / 1e6:.1f} MB")
    return 0


def _export_depth(args: argparse.Namespace) -> int:
    from studio.engine.errors import SettingsError
    from studio.take.depth_export import export_depth
    from studio.take.take import Take

    if args.format != "mkv":
        raise SettingsError(f"camera={args.camera}: goes with --format mkv; leave it out for {args.format}")
    for option in _OF_SOLVES:
        value = getattr(args, option)
        if value not in (args.usual[option], None, False, []):
            raise SettingsError(f"{option}={value}: mkv holds depth as it was recorded; leave it out")
    with progress_bar("Exporting") as progress:
        camera, count = export_depth(Take.open(args.take), args.out, args.camera, progress=progress)
    print(f"{args.out}: {count} depth images of {camera}, {args.out.stat().st_size / 1e6:.1f} MB")
    return 0


def _rig(args: argparse.Namespace) -> "Onto | None":
    """Return the rig that is exported onto, None for the performer's own skeleton."""
    from studio.engine.errors import SettingsError
    from studio.engine.retarget.onto import open_rig

    if args.rig is not None:
        return open_rig(args.rig, args.mapping)
    if args.mapping is not None:
        raise SettingsError(f"mapping={args.mapping}: goes with --rig; give the rig's file too")
    return None


def load_solve(take: "Take", wanted: str | None) -> "tuple[Poses, str]":
    """Return the poses of a take's solve, and its name.

    Raises:
        TakeError: the take has no solve of that name, or none at all.
    """
    from studio.engine.poses import Poses

    name = choose_solve(take.solve_names(), wanted, str(take.path))
    return Poses.load(take.solve_folder(name) / "poses.npz"), name


def _options(args: argparse.Namespace, take: "Take", poses: "Poses") -> "ExportOptions":
    from studio.engine.export import ExportOptions

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
    """Return the timecode, of the take where that is wanted, at the frames of the export."""
    from studio.engine.errors import SettingsError

    if wanted != "take":
        return wanted
    known = take.meta.get("timecode")
    if known is None:
        raise SettingsError(f"timecode=take: take {take.path} has none; give it as hh:mm:ss:ff")
    whole, _, frames = known.rpartition(":")
    return f"{whole}:{int(int(frames) * round(fps) / _TIMECODE_HZ):02d}"


def choose_solve(available: list[str], wanted: str | None, take: str) -> str:
    """Return the solve to use: the one that is named, else the best by its name.

    Raises:
        TakeError: the take has no solve of that name, or none at all.
    """
    from studio.engine.errors import TakeError

    if wanted is not None and wanted in available:
        return wanted
    if not available:
        raise TakeError(f"take {take} has no solve yet; run `studio solve {take}`")
    if wanted is not None:
        raise TakeError(f"take {take} has no solve {wanted!r}; it has: {', '.join(available)}")
    return next((name for name in PREFERRED if name in available), available[0])
