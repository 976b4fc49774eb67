"""Takes on disk. Rooms: `folder` is one take, `edits` what an operator says of it, `raw` its recorded frames,
`importers` makes takes of other recordings, `library` lists and changes whole takes, `upkeep` checks and repairs them
and checks the program.
"""
