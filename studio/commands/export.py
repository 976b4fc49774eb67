"""`studio export`: a solve as a file for animation programs."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command, add_take

_TEXT = """\
Write a solve as a file for animation programs: FBX (with cubic keys) or BVH.

Without --solve, the best solve of the take is taken: finish, studio, live, or the first by name."""

PREFERRED = ("finish", "studio", "live", "imported")


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "export", run, _TEXT)
    add_take(parser)
    parser.add_argument(
        "--format", required=True, choices=("fbx", "bvh", "glb", "c3d", "trc", "csv", "npz", "usd"),
        help="kind of file; this version writes fbx and bvh",
    )  # fmt: skip
    parser.add_argument("--out", metavar="FILE", type=Path, required=True, help="the file to write")
    parser.add_argument("--solve", metavar="NAME", help="which solve")
    parser.add_argument(
        "--target",
        choices=("humanik", "mixamo", "unreal", "vrm"),
        default="humanik",
        help="names of the skeleton",
    )
    parser.add_argument("--fps", metavar="F", type=float, help="frames per second (default: the solve's)")
    parser.add_argument(
        "--interpolation",
        choices=("cubic", "linear", "constant"),
        default="cubic",
        help="between keys, in FBX",
    )
    parser.add_argument(
        "--root-motion",
        choices=("hips", "root", "in-place"),
        default="hips",
        help="which bone carries the path",
    )
    parser.add_argument("--mesh", action="store_true", help="add a body")


def run(args: argparse.Namespace) -> int:
    from studio.engine.export import export
    from studio.engine.poses import Poses
    from studio.take.take import Take

    take = Take.open(args.take)
    name = choose_solve(take.solve_names(), args.solve, str(take.path))
    poses = Poses.load(take.solve_folder(name) / "poses.npz")
    export(
        poses,
        args.out,
        args.format,
        fps=args.fps,
        interpolation=args.interpolation,
        target=args.target,
        root_motion=args.root_motion,
        mesh=args.mesh or None,
        take_name=args.take.resolve().name,
    )
    print(f"{args.out}: solve {name}, {poses.frame_count} frames, {args.out.stat().st_size / 1e6:.1f} MB")
    return 0


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
