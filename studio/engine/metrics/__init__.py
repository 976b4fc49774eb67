"""How far a solve is from a reference: one concept per file, joined by `evaluate.evaluate`.

reference.py    a reference motion and reading it from a file
markers.py      a reference of markers: their offsets from the joints are fitted
target_table.py reading a table of rigid targets
matching.py     a solve and a reference brought to the same joints and instants
alignment.py    the rigid or similarity alignment, and the time alignment for a reference with a clock of its own
position.py     distances between joints
pck.py          share of joints within a distance
angles.py       joint angles after the ISB
smoothness.py   differences of acceleration, and jerk, over 1/30 s
spectral_arc.py smoothness of speeds by their spectrum
latency.py      how long the solve lags
feet.py         when feet stand, and how they slide
contacts.py     contacts found, and how high standing feet are
bones.py        how constant bone lengths are
honesty.py      the solve's own 90 % balls against its errors
thesis.py       the four figures of the thesis
cleanup/        what an animator would have to mend
compare.py      two solves of a take without a reference
"""
