"""`studio camera`: a camera client."""

import argparse
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from studio.commands.common import add_command
from studio.engine.base.value_sentences import bad_value
from studio.server.config import read_token

_TEXT = """\
Run a camera client: read a source and send its frames to the studio.

SOURCE is one of
  simulated:INDEX/COUNT[:SEED]           a camera of a standard rig that watches the simulated performer
  simulated-depth:INDEX/COUNT[:SEED]     the same camera with depth images
  simulated-rgb:INDEX/COUNT[:SEED]       the same camera with landmarks in pictures
  recording:PATH[#CAMERA][?speed=max]    a take or a recording, in a loop in real time, or once at full speed
  realsense[:SERIAL]  orbbec[:SERIAL]    devices; docs/devices.md lists their requirements
  openni[:NUMBER]  azure-kinect[:NUMBER]  kinect-v2[:NUMBER]
  webcam[:NUMBER][?model=MODEL][&mirrored][&no-hands]      a webcam; MODEL is lite, full (default), heavy or a file
  video:PATH[?speed=max][&model=MODEL][&mirrored][&no-hands]  a video file, in a loop in real time, or once

This machine finds skeleton, hand states and head orientation in depth images. In pictures it
finds landmarks. It waits for an unplugged device.
During a recording, every frame is also kept in a spool on this machine until the studio has it on its disk. After a
drop-out of the link, missing frames are sent again, also by the next start. Stop it with Ctrl-C."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "camera", run, _TEXT)
    parser.add_argument(
        "--source", metavar="SOURCE", required=True, help="source of the frames, such as simulated:0/2"
    )
    parser.add_argument(
        "--server",
        metavar="URL",
        help="the studio (default http://127.0.0.1:8000)",
    )
    parser.add_argument(
        "--wait",
        metavar="HOST",
        nargs="?",
        const="0.0.0.0",
        help="announce the camera on the network, and wait until an operator connects it on the studio's page with "
        "the code that is shown here; HOST: address to wait on (default: all of this machine)",
    )
    parser.add_argument("--name", metavar="NAME", help="name of the camera (default: the source's)")
    parser.add_argument(
        "--token",
        metavar="T",
        help="a token for cameras, if the studio requires one (default: STUDIO_CAMERA_TOKEN of the environment)",
    )
    parser.add_argument(
        "--token-file",
        metavar="FILE",
        type=Path,
        help="file with that token (default: STUDIO_CAMERA_TOKEN_FILE of the environment)",
    )
    parser.add_argument(
        "--certificate",
        metavar="FILE",
        type=Path,
        help="the studio's certificate (PEM), if this machine does not trust it, as one that signed itself",
    )
    parser.add_argument(
        "--spool",
        metavar="DIR",
        type=Path,
        help="folder of the spool (default: one per studio and name, in your home)",
    )
    parser.add_argument(
        "--spool-mb",
        metavar="MB",
        type=int,
        default=2048,
        help="largest size of the spool (default 2048)",
    )
    parser.add_argument(
        "--drop-unknown",
        action="store_true",
        help="delete spooled frames of takes that the studio lacks (else they stay for 30 days)",
    )
    parser.add_argument(
        "--record-depth",
        action="store_true",
        help="send the depth images too during a recording (2 to 10 MB/s)",
    )
    parser.add_argument(
        "--keep-video",
        action="store_true",
        help="record the video of a webcam or video:PATH during takes (about 1 MB/s), for the studio to fetch",
    )
    parser.add_argument(
        "--preview", action="store_true", help="draw the image of a depth camera as text in the terminal"
    )
    parser.add_argument(
        "--preview-port",
        metavar="P",
        type=int,
        help="show the image of a depth camera as a page on this port of this machine (0: a free one)",
    )
    parser.add_argument("--parent", metavar="PID", type=int, help=argparse.SUPPRESS)


def chosen_token(args: argparse.Namespace, environment: Mapping[str, str]) -> str:
    """Return the token of the flags, else of the environment; may be empty.

    Raises:
        SettingsError: a file without a token.
    """
    if args.token is not None:
        return args.token
    if args.token_file is not None:
        return read_token(args.token_file, "--token-file")
    if "STUDIO_CAMERA_TOKEN" in environment:
        return environment["STUDIO_CAMERA_TOKEN"]
    file = environment.get("STUDIO_CAMERA_TOKEN_FILE")
    return read_token(Path(file) if file else None, "STUDIO_CAMERA_TOKEN_FILE")


def run(args: argparse.Namespace) -> int:
    from studio.engine.base.errors import SettingsError
    from studio.engine.base.loading import loading

    with loading():
        from studio.camera.client.run import run_camera

    if args.spool_mb < 1:
        raise SettingsError(bad_value("--spool-mb", args.spool_mb, "1 or more"))
    if args.preview_port is not None and not 0 <= args.preview_port <= 65535:
        raise SettingsError(bad_value("--preview-port", args.preview_port, "0 to 65535"))
    options: dict[str, Any] = {
        "spool": args.spool,
        "spool_bytes": args.spool_mb << 20,
        "parent": args.parent,
        "record_depth": args.record_depth,
        "preview": args.preview,
        "preview_port": args.preview_port,
        "drop_unknown": args.drop_unknown,
        "keep_video": args.keep_video,
        "certificate": args.certificate,
    }
    if args.wait is not None:
        if args.server is not None or args.token is not None or args.token_file is not None:
            raise SettingsError(
                "waiting.no_server",
                "--wait is not allowed with --server or a token: the studio that calls gives both; leave them out",
            )
        from studio.camera.waiting.run import run_waiting

        return run_waiting(args.source, args.name, args.wait, **options)
    server = "http://127.0.0.1:8000" if args.server is None else args.server
    return run_camera(args.source, server, args.name, chosen_token(args, os.environ), **options)
