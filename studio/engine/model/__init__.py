"""Common types: joints, frames, poses, calibrations, depth images and settings.

`joints` names joints and `roles` recognises them in foreign skeletons, `frames` holds the data of the pipeline,
`calibration` the result of calibrating, `poses` and `solve_metrics` the result of a solve.

Rooms: `cameras` (lenses and depth images), `triangulation` (joints from pictures without depth), `settings` (every
switch), `performers` (choices for each) and `human` (the humanoid model).
"""
