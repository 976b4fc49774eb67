"""Finishing: the whole take solved at once, with the future known (`finish=on`, preset `finish`).

`store` keeps a take's steps on disk, `measurements` says what cameras tell, `lost_limbs` brings back limbs that the
first solve lost, `trajectory` gives joint positions and Jacobians of all frames, `contacts` finds standing feet and
the floor, `places` where they stand, `body_contact` keeps parts of the body out of one another, `smoother` is the
banded least-squares problem, `soles` puts the take on the floor, `radii` says how wrong each joint may be, and
`finisher` runs it all over a take, window by window.
"""
