"""Finishing: the whole take solved at once, with the future known (`finish=on`, preset `finish`).

`measurements` gathers every camera's joints at the output times, `trajectory` gives joint positions and
Jacobians of all frames, `contacts` finds standing feet, `smoother` is the banded least-squares problem, and
`finisher` runs it over a take in overlapping chunks.
"""
