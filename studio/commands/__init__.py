"""The commands of the command line, one module each; `common` holds what several share.

Each has `add_parser(subparsers)`, which describes it, and `run(args) -> int`, which runs it and returns the
exit code. Imports of a command are inside `run`, so that `studio --help` is fast.

Rooms: `stage` (the server, its cameras and its machine), `takes` (all that is done with takes), `characters` (rigs
and robots) and `lab` (experiments and speed).
"""
