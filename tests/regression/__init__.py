"""A small fixed set of takes and its figures (`figures.json`), which no change may worsen by more than their noise.

The takes go through the whole chain: frames as cameras sent them, calibration, solve, evaluation. `python -m
tests.regression` compares the present figures with it; `--update` writes them, `--noise` measures their noise again.
"""
