"""Settings of a solve.

`switches` holds the types of switches, `by_performer` the one that differs between performers, and `settings` the
table of all switches, the presets and the parser.

In: the names and values that a user chose. Out: `SolveSettings`, checked.
"""
