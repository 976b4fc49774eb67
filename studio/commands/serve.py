"""`studio serve`: the server with its page and browser view."""

import argparse
from pathlib import Path
from typing import Any

from studio.commands.common import add_command

_TEXT = """\
Open the studio: the server, its page and the browser view.

Camera clients connect to it (`studio camera`), also from other machines when --host allows it: then operators sign
in with the token that is printed here, and cameras need a token of their own. With --demo, two simulated cameras
watch a simulated performer. Stop it with Ctrl-C."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "serve", run, _TEXT)
    parser.add_argument(
        "--host", metavar="H", default="127.0.0.1", help="address to listen on (default 127.0.0.1)"
    )
    parser.add_argument(
        "--port", metavar="P", type=port, default=8000, help="port to listen on (default 8000)"
    )
    parser.add_argument(
        "--sessions",
        metavar="DIR",
        type=Path,
        default=Path("sessions"),
        help="folder of the recorded takes (default sessions, in the folder where the studio is started)",
    )
    parser.add_argument(
        "--tls-cert", metavar="FILE", type=Path, help="certificate (PEM), to encrypt with --tls-key"
    )
    parser.add_argument("--tls-key", metavar="FILE", type=Path, help="the certificate's private key (PEM)")
    parser.add_argument("--demo", action="store_true", help="start a simulated stage of two cameras")
    parser.add_argument("--demo-on-first-run", action="store_true", help=argparse.SUPPRESS)


def port(text: str) -> int:
    """Return a port number, 0 to 65535; 0 takes a free one (an argparse type)."""
    if not (text.isascii() and text.isdigit() and int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"{text!r} is no port; allowed: 0 to 65535")
    return int(text)


def run(args: argparse.Namespace) -> int:
    from studio.api.server import Tls, serve
    from studio.engine.errors import SettingsError

    if (args.tls_cert is None) != (args.tls_key is None):
        raise SettingsError("--tls-cert and --tls-key belong together; give both, or none")
    tls = None if args.tls_cert is None else Tls(args.tls_cert, args.tls_key)
    demo = args.demo or (args.demo_on_first_run and is_first_run(args.sessions))
    return serve(host=args.host, port=args.port, sessions=args.sessions, demo=demo, tls=tls)


def is_first_run(sessions: Path) -> bool:
    """Whether no take lies in the folder of sessions yet."""
    return next(sessions.glob("*/*/take.json"), None) is None
