"""`studio config`: the configuration of `studio serve`, and the origin of each value."""

import argparse
from typing import Any

from studio.commands.common import add_command, add_json, table, write_result
from studio.commands.stage.serve import add_server_options, chosen_config

_TEXT = """\
Show the configuration in force and the origin of each value.

Values come from defaults, then studio.toml (or the file named by STUDIO_CONFIG), then STUDIO_... of the
environment, then flags; later ones override earlier ones. docs/configuration.md lists them."""


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
