"""`studio camera`: a camera client."""

import argparse
from typing import Any

from studio.commands.common import add_command

_TEXT = """\
Run a camera client: read a source and send its frames to the studio.

SOURCE is one of
  simulated:INDEX/COUNT[:SEED]           a camera of a standard rig that watches the simulated performer
  recording:PATH[#CAMERA][?speed=max]    a take or a recording, over and over in real time, or once at full speed

When the link drops, frames are kept and sent once it is back. Stop it with Ctrl-C."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "camera", run, _TEXT)
    parser.add_argument(
        "--source", metavar="SOURCE", required=True, help="where frames come from, such as simulated:0/2"
    )
    parser.add_argument(
        "--server",
        metavar="URL",
        default="http://127.0.0.1:8000",
        help="the studio (default http://127.0.0.1:8000)",
    )
    parser.add_argument("--name", metavar="NAME", help="name of the camera (default: the source's)")
    parser.add_argument(
        "--token", metavar="T", default="", help="the studio's token for cameras, where it asks for one"
    )


def run(args: argparse.Namespace) -> int:
    from studio.camera.client import run_camera

    return run_camera(source=args.source, server=args.server, name=args.name, token=args.token)
