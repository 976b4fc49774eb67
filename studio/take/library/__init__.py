"""The library of takes: the list of sessions, and operations on whole takes.

`sessions` lists them, `slate` changes their names and notes, `trash` holds removed ones, `bundle`
packs one into a file, `borrow` takes another take's calibration, `live_solve` saves the live poses as a solve,
`presets` stores settings, `exports` writes files for other programs.
"""
