"""The command line: `studio COMMAND ...`, one module of a room of `studio.commands` per command.

Exit codes: 0 done, 1 failed (one line on standard error), 2 wrong use (an unknown option, setting or value).
"""

import argparse
import importlib
import json
import os
import sys
from importlib import metadata

from studio.commands.common import spread_settings
from studio.engine.base.errors import SettingsError, StudioError
from studio.engine.base.sentences import Said
from studio.engine.base.system import leave_out_windows

ERRORS = "STUDIO_ERRORS"
"""Environment variable; `json` prints an error that has a code as a line of JSON, for the server's own clients."""

COMMANDS = {
    "serve": "stage.serve",
    "certificate": "stage.certificate",
    "camera": "stage.camera",
    "simulate": "takes.simulate",
    "import": "takes.import_take",
    "calibrate": "takes.calibrate",
    "board": "takes.board",
    "solve": "takes.solve",
    "edit": "takes.edit",
    "splice": "takes.splice",
    "rigid": "takes.rigid",
    "performers": "takes.performers",
    "evaluate": "takes.evaluate",
    "study": "lab.study",
    "export": "takes.export",
    "rig": "characters.rig",
    "robot": "characters.robot",
    "bench": "lab.bench",
    "prepare": "stage.prepare",
    "doctor": "stage.doctor",
    "config": "stage.config",
    "batch": "takes.batch",
    "picture": "takes.picture",
}
"""The module of each command in `studio.commands`."""

_DESCRIPTION = """\
Markerless motion capture from several cameras, in the browser.

Without a command the studio opens on http://127.0.0.1:8000, on first run with a simulated stage; options are then
those of `serve`."""

_EPILOG = """\
a recording from start to end:
  studio import RECORDING --out TAKE
  studio calibrate TAKE
  studio solve TAKE
  studio evaluate TAKE --reference TRUTH.csv
  studio export TAKE --format fbx --out TAKE.fbx

`studio COMMAND --help` explains a command."""


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of the whole command line; every command sets `run`, a function args -> exit code."""
    parser = argparse.ArgumentParser(
        prog="studio",
        description=_DESCRIPTION,
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"studio {metadata.version('capture-studio')}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands")
    for module in COMMANDS.values():
        importlib.import_module(f"studio.commands.{module}").add_parser(subparsers)
    return parser


def main(argv: list[str] | None = None) -> int:
    """Run one command and return its exit code; wrong use ends with SystemExit(2), as in argparse."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    if not arguments or (arguments[0].startswith("-") and arguments[0] not in ("-h", "--help", "--version")):
        arguments = ["serve", "--demo-on-first-run", *arguments]
    if argv is None and arguments[0] != "robot":  # of its own process; MuJoCo draws robots
        leave_out_windows()
    try:  # loading the commands takes a second or two, in which Ctrl-C may arrive
        return _run(make_parser().parse_args(spread_settings(arguments)))
    except KeyboardInterrupt:
        return 130


def _run(args: argparse.Namespace) -> int:
    """Run a command; its errors are one line each."""
    try:
        return args.run(args)
    except SettingsError as error:
        return _fail(args.command, error, 2)
    except StudioError as error:
        return _fail(args.command, error, 1)
    except BrokenPipeError:  # the reader of the output has ended, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        return _fail(args.command, error, 1)


def _fail(command: str, error: Exception, code: int) -> int:
    """Write the error on one line of standard error, with its code if `STUDIO_ERRORS` is `json`."""
    text = " ".join(str(error).split()) or type(error).__name__
    said = error.sentence if isinstance(error, StudioError) else text
    if isinstance(said, Said) and os.environ.get(ERRORS) == "json":
        text = json.dumps(said.to_json())
    print(f"studio {command}: {text}", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
