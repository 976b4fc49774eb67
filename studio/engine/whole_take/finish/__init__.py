"""Finishing: the whole take solved at once, from past and future frames (`finish=on`, preset `finish`).

`store` keeps a take's steps on disk, `measurements` the cameras' joints and noise, `lost_limbs` restarts limbs that
the first solve lost, `trajectory` computes joint positions and Jacobians of all frames, `contacts` finds standing
feet and the floor, `places` where they stand, `body_contact` keeps parts of the body apart,
`smoother` is the banded least-squares problem, `soles` puts the take on the floor, and `radii` estimates each joint's
error. `finisher` runs them over a take, window by window.
"""
