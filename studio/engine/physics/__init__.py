"""Physics (`physics=on`, with `finish`): a finished take is corrected so that forces can explain it.

`points` are the places that may bear on the floor, `dynamics` what a trajectory demands of external force and
moment, `forces` the contact forces that explain them best, `torques` what is left for the joints and `strength`
what joints can do. `correction` is finishing's banded problem with rows for what is unexplained, too strong or under
the floor; `measure` says how well a motion is explained, `verdict` where the corrected one is kept, and `whole_take`
joins both.
"""
