"""How far a solve is from a reference: one concept per file, joined by `evaluate.evaluate`.

reference.py   a reference motion and reading it from CSV or BVH
matching.py    a solve and a reference brought to the same joints and instants
alignment.py   the rigid alignment, and the time alignment for a reference with a clock of its own
position.py    distances between joints
smoothness.py  differences of acceleration, and jerk, over 1/30 s
latency.py     how long the solve lags
feet.py        sliding of standing feet
bones.py       how constant bone lengths are
honesty.py     the solve's own 90 % balls against its errors
thesis.py      the four figures of the thesis
"""
