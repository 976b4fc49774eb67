"""`studio import`: other recordings and animations as a take."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command, progress_bar

_TEXT = """\
Turn camera recordings, or an animation, into a take.

PATH is a video, or a folder of videos, one per camera; a folder of camera_0, camera_1, ... each with joints.csv, or
with depth.txt and camera.json; an Azure Kinect .mkv, a RealSense or ROS .bag or .db3, or a folder of these, a
camera each; a raw.mcap; a CSV with the skeletons of Kinects; or a folder with the
landmarks of OpenPose, Pose2Sim, MMPose, AlphaPose or FreeMoCap, best with the videos beside. The
readable part of a truncated file is imported. An existing take is never overwritten, and a failed import leaves no
files.

A .bvh, .fbx, .glb, .c3d or .trc is an animation: its take has no raw, and the solve `imported`."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "import", run, _TEXT)
    parser.add_argument("path", metavar="PATH", type=Path, help="the recording")
    parser.add_argument(
        "--unit-m", metavar="M", type=float, help="metres per unit of a BVH (default: by a height of 1.75 m)"
    )
    parser.add_argument(
        "--model",
        "--pose-network",
        metavar="MODEL",
        help="finds the landmarks in videos: lite, full (default), heavy, a bundle, or the description of an ONNX "
        "network",
    )
    parser.add_argument("--no-hands", action="store_true", help="do not look for the hands in videos")
    parser.add_argument(
        "--sync",
        metavar="WAY",
        help="brings videos to one clock: audio, clap, timecode, motion (left to calibrate), none (they begin "
        "together), or auto (default: the first that is clear)",
    )
    parser.add_argument(
        "--clap-at",
        metavar="[CAMERA=]SECOND",
        action="append",
        default=[],
        help="about when the clap is heard, in a camera's video or in all; may be given several times",
    )
    parser.add_argument(
        "--no-video", action="store_true", help="leave the videos out of the take; its replay shows none then"
    )
    parser.add_argument("--out", metavar="TAKE", type=Path, required=True, help="folder of the new take")


def run(args: argparse.Namespace) -> int:
    from studio.take.importers import import_recording
    from studio.take.video.sync.clap_at import read_clap_at

    clap_at_s = read_clap_at(args.clap_at)
    with progress_bar("import") as progress:
        take = import_recording(
            args.path,
            args.out,
            unit_m=args.unit_m,
            model=args.model,
            hands=not args.no_hands,
            keep_videos=not args.no_video,
            sync=args.sync,
            clap_at_s=clap_at_s,
            progress=progress,
        )
    cameras = ", ".join(take.camera_names)
    what = f"{len(take.camera_names)} cameras ({cameras})" if cameras else "an animation, solve imported"
    print(f"{take.path}: {what}")
    for note in take.meta.get("notes", "").splitlines():
        print(f"  {note}")
    return 0
