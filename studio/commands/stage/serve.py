"""`studio serve`: the server with its page and browser view."""

import argparse
import os
from dataclasses import fields
from pathlib import Path
from typing import Any

from studio.commands.common import add_command
from studio.engine.base.errors import SettingsError
from studio.server.config import DISCOVER, LOG_FORMATS, LOG_LEVELS, Config, Effective, effective

_TEXT = """\
Open the studio: the server, its page and the browser view.

Camera clients connect to it (`studio camera`), also from other machines if --host allows it. Operators then sign in
with the token that is printed here, and cameras need their own token. With --demo, two simulated cameras
watch a simulated performer; with --cameras rgb, three that see pictures, as webcams and phones do; with
--performers 2, three that see two performers. Stop it with Ctrl-C."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "serve", run, _TEXT)
    add_server_options(parser)
    parser.add_argument("--demo", action="store_true", help="start a simulated stage of two cameras")
    parser.add_argument(
        "--cameras",
        choices=("skeletons", "rgb"),
        help="start the simulated stage with this kind of cameras (--demo: skeletons)",
    )
    parser.add_argument(
        "--performers",
        type=int,
        choices=range(1, 5),
        default=1,
        metavar="N",
        help="how many performers the simulated stage has, 1 to 4 (default 1); several are seen by three cameras",
    )
    parser.add_argument("--demo-on-first-run", action="store_true", help=argparse.SUPPRESS)


def add_server_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `Config`; missing ones come from the environment, a file or the defaults."""
    add = parser.add_argument
    add("--host", metavar="H", help="address to listen on (default 127.0.0.1)")
    add("--port", metavar="P", type=port, help="port to listen on (default 8000)")
    add(
        "--sessions",
        metavar="DIR",
        type=Path,
        help="folder of the recorded takes (default sessions, in the folder where the studio is started)",
    )
    add(
        "--recordings",
        metavar="DIR",
        type=Path,
        help="folder whose recordings the page may open as cameras, beside the takes",
    )
    add("--tls-cert", metavar="FILE", type=Path, help="certificate (PEM), to encrypt with --tls-key")
    add("--tls-key", metavar="FILE", type=Path, help="the certificate's private key (PEM)")
    add(
        "--operator-token-file",
        metavar="FILE",
        type=Path,
        help="file with the token of operators (default: a new token at every start, which is printed)",
    )
    add("--camera-token-file", metavar="FILE", type=Path, help="file with a token for cameras")
    add(
        "--discover",
        choices=DISCOVER,
        help="list cameras that wait on the network (studio camera --wait): auto (default) does so on a loopback "
        "address alone",
    )
    add(
        "--timecode",
        metavar="SOURCE",
        help="timecode to listen to where nothing was chosen on the page yet: clock, ltc:..., mtc:..., artnet... "
        "(default off)",
    )
    add("--timecode-rate", metavar="RATE", help="its rate (default 25)")
    add("--log-format", choices=LOG_FORMATS, help="format of the log (default text)")
    add("--log-level", choices=LOG_LEVELS, help="lowest level that is logged (default info)")


def chosen_config(args: argparse.Namespace) -> Effective:
    """Return the configuration of the flags, the environment and the file in the present folder.

    Raises:
        SettingsError: see `config.effective`.
    """
    flags = {one.name: getattr(args, one.name, None) for one in fields(Config)}
    return effective(flags, os.environ, Path.cwd())


def port(text: str) -> int:
    """Return a port number, 0 to 65535; 0 chooses a free one (an argparse type)."""
    if not (text.isascii() and text.isdigit() and int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"{text!r} is no port; allowed: 0 to 65535")
    return int(text)


def run(args: argparse.Namespace) -> int:
    from studio.server.start import serve

    config = chosen_config(args).config
    demo = args.demo or (args.demo_on_first_run and is_first_run(config.sessions))
    if args.performers > 1 and args.cameras == "rgb":
        raise SettingsError(
            "demo.performers",
            "--performers {count} is not possible with --cameras rgb: cameras that see pictures follow one "
            "performer; leave one of the two out",
            count=args.performers,
        )
    kind = args.cameras or ("skeletons" if demo or args.performers > 1 else None)
    code = serve(config, demo=kind, performers=args.performers)
    from studio.server.run import leave

    leave(code)


def is_first_run(sessions: Path) -> bool:
    """Whether the folder of sessions has no take yet."""
    return next(sessions.glob("*/*/take.json"), None) is None
