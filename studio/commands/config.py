"""`studio config`: the configuration that `studio serve` would run with, and where each value comes from."""

import argparse
from typing import Any

from studio.commands.common import add_command, add_json, table, write_result
from studio.commands.serve import add_server_options, chosen_config

_TEXT = """\
Show the configuration in force and where each value comes from.

Values come from defaults, then studio.toml (or the file that STUDIO_CONFIG names), then STUDIO_... of the
environment, then flags; the later wins. docs/configuration.md lists them."""


def add_parser(subparsers: Any) -> None:
    parser = add_command(subparsers, "config", run, _TEXT)
    add_server_options(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    found = chosen_config(args)
    values = {name: getattr(found.config, name) for name in found.sources}
    texts = {name: "" if value is None else str(value) for name, value in values.items()}
    print(table([("key", "value", "from"), *((name, texts[name], found.sources[name]) for name in texts)]))
    write_result(args, {name: {"value": texts[name], "from": found.sources[name]} for name in texts})
    return 0
