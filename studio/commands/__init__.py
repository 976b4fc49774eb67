"""The commands of the command line, one module each.

Each has `add_parser(subparsers)`, which describes it, and `run(args) -> int`, which does it and returns the
exit code. What a command needs is imported inside `run`, so that `studio --help` is there at once.
"""
