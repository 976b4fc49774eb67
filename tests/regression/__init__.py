"""A small fixed set of takes and its figures (`figures.json`), which no change may worsen by more than their noise.

The takes go through the whole chain: frames as cameras sent them, calibration, solve, evaluation. `python -m
tests.regression` shows how the present figures compare; `--update` writes them, `--noise` finds their noise anew.
"""
