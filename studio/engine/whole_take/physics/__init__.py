"""Physics (`physics=on`, with `finish`): corrects a finished take so that contact forces can explain it.

`points` are the places that may bear on the floor, `dynamics` computes the external force and moment that a
trajectory needs, `forces` the best contact forces for them, `torques` the joint torques, and `strength` their bounds.
`correction` adds rows to finishing's banded problem for unexplained forces, excessive torques and soles under the
floor. `measure` rates a motion, `verdict` decides where the corrected one is kept, and `whole_take` joins both.
"""
