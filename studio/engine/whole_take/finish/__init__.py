"""Finishing: the whole take solved at once, from past and future frames (`finish=on`, preset `finish`).

`store` keeps a take's steps on disk, `measurements` the cameras' joints and noise, `lost_limbs` restarts limbs that
the first solve lost, `trajectory` computes joint positions and Jacobians of all frames, `contact` finds standing feet
and the floor and keeps surfaces apart, `smoother` is the banded least-squares problem, and `radii` estimates each
joint's error. `finisher` runs them over a take, window by window.
"""
