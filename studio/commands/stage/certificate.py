"""`studio certificate`: a certificate for the studio, so that browsers on other machines give it their camera."""

import argparse
import datetime
from pathlib import Path
from typing import Any

from studio.commands.common import add_command
from studio.commands.stage.serve import chosen_config

_TEXT = """\
Make a certificate for this machine, so that phones can be cameras.

A browser gives its camera only to encrypted pages. The certificate is for all names and addresses of this machine;
the studio uses it when it is opened to the network (`studio serve --host 0.0.0.0`). Since it signed itself, each
browser warns once. Run it again when the machine's address has changed, or after a year."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "certificate", run, _TEXT)
    add = parser.add_argument
    add(
        "--sessions",
        metavar="DIR",
        type=Path,
        help="folder of the recorded takes, where it is kept (as in serve)",
    )
    add(
        "--name",
        metavar="NAME",
        action="append",
        default=[],
        help="a further name or address of this machine",
    )


def run(args: argparse.Namespace) -> int:
    from studio.api.access.fingerprint import fingerprint
    from studio.server.certificate import make_certificate, own_names

    names = list(dict.fromkeys([*own_names(), *args.name]))
    now = datetime.datetime.now(datetime.UTC)
    made = make_certificate(chosen_config(args).config.sessions, names, now)
    print(f"certificate {made.certificate}, key {made.key}, valid until {made.until:%Y-%m-%d}")
    print(f"for {', '.join(made.names)}")
    print(f"fingerprint (SHA-256): {fingerprint(made.certificate)}")
    print("start `studio serve --host 0.0.0.0`: it is used from then on")
    return 0
