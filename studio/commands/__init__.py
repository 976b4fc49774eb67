"""The commands of the command line, one module each.

Each has `add_parser(subparsers)`, which describes it, and `run(args) -> int`, which runs it and returns the
exit code. Imports of a command are inside `run`, so that `studio --help` is fast.
"""
