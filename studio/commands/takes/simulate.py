"""`studio simulate`: a take of simulated cameras that watch a real motion."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command, progress_bar

_TEXT = """\
Record a take of simulated cameras that watch the performer of an animation (.bvh, .fbx, .glb, .c3d, .trc), or the
embedded one (`demo`).

The take begins with a calibration part (T-pose for 3 s, then 30 s of walking). The true joint centres go
to TAKE.truth.csv beside the take, for `studio evaluate` only."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "simulate", run, _TEXT)
    parser.add_argument(
        "motion",
        metavar="MOTION.bvh",
        type=Path,
        nargs="+",
        help="the motion (the first frame of a BVH, a rest pose, is dropped), or `demo`; one for each performer",
    )
    parser.add_argument("--out", metavar="TAKE", type=Path, required=True, help="folder of the new take")
    parser.add_argument(
        "--cameras", metavar="N", type=int, choices=(1, 2, 3, 4), default=2, help="1 to 4 (default 2)"
    )
    parser.add_argument(
        "--sensor",
        choices=(
            "ideal",
            "kinect-v1",
            "kinect-v2",
            "azure-kinect",
            "azure-kinect-unbinned",
            "femto-bolt",
            "d435",
        ),
        default="ideal",
        help="the depth sensor (default ideal); the noise of noisy-joints does not depend on it",
    )
    parser.add_argument(
        "--tracker", choices=("depth", "noisy-joints", "rgb"), default="noisy-joints",
        help="noisy-joints: true joints with a tracker's errors; depth: depth images of a performer in a room; "
        "rgb: landmarks in pictures of ordinary cameras",
    )  # fmt: skip
    parser.add_argument(
        "--performer", metavar="NAME", default="tuning-average",
        help="body for depth cameras, such as tuning-slim or scoring-child (default tuning-average)",
    )  # fmt: skip
    parser.add_argument(
        "--meeting",
        choices=("apart", "passing", "circling", "back-to-back", "embracing", "lifting"), default="passing",
        help="how several performers move about one another (default passing)",
    )  # fmt: skip
    parser.add_argument("--furniture", action="store_true", help="depth cameras see furniture")
    parser.add_argument(
        "--prop",
        metavar="SHAPE",
        help="depth cameras see a thing in the right hand, such as cylinder:3,90 (cm)",
    )
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="of the noise (default 0)")
    parser.add_argument(
        "--unit-m",
        metavar="M",
        type=float,
        help="metres per unit of the BVH (default: by a height of 1.75 m)",
    )
    parser.add_argument(
        "--rig", metavar="FILE", type=Path, help="JSON with the cameras' poses instead of the standard rig"
    )
    parser.add_argument("--no-calibration", action="store_true", help="leave out the calibration part")


def run(args: argparse.Namespace) -> int:
    from studio.simulator.simulate import simulate_take
    from studio.take.folder.take import Take

    with progress_bar("simulate") as progress:
        path = simulate_take(
            args.motion,
            args.out,
            cameras=args.cameras,
            sensor=args.sensor,
            tracker=args.tracker,
            seed=args.seed,
            unit_m=args.unit_m,
            rig=args.rig,
            calibration=not args.no_calibration,
            performer=args.performer,
            furniture=args.furniture,
            meeting=args.meeting,
            prop=args.prop,
            progress=progress,
        )
    print(f"{path}: the take; {Take.open(path).meta.get('notes', '')}")
    which = "csv" if len(args.motion) == 1 else "performer_1.csv, ..."
    print(f"{path}.truth.{which}: the true joints, for `studio evaluate --reference` alone")
    return 0
