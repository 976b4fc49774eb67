"""Takes on disk. Packages: `folder` is one take, `edits` its edits by an operator, `raw` its recorded frames,
`importers` makes takes from other recordings, `library` lists and changes whole takes, `upkeep` checks and repairs
them and checks the program.
"""
