"""Figures of a solve, against a reference or alone. `evaluate.evaluate` computes all of them.

own.py       figures without a reference
compare.py   two solves of a take
cleanup/     edit list of an animation: what an animator would correct

figures/angles.py        joint angles after the ISB
figures/bones.py         variation of bone lengths
figures/contacts.py      contacts found, and heights of standing feet
figures/feet.py          stances of feet, and their slide
figures/honesty.py       the solve's own 90 % balls against its errors
figures/latency.py       lag of the solve
figures/pck.py           share of joints within a distance
figures/position.py      distances between joints
figures/smoothness.py    differences of acceleration, and jerk, over 1/30 s
figures/spectral_arc.py  smoothness of speeds by their spectrum
figures/thesis.py        the four figures of the thesis

reference/reference.py     a reference motion and its reader
reference/markers.py       a reference of markers: their offsets from the joints are fitted
reference/target_table.py  reader of a table of rigid targets
reference/matching.py      a solve and a reference at the same joints and instants
reference/alignment.py     rigid or similarity alignment, and time alignment for a reference with its own clock
"""
