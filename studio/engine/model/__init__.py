"""Common types: joints, frames, poses, calibrations, depth images and settings.

`joints` names joints, `frames` holds the data of the pipeline, `calibration` the result of calibrating, `settings`
every switch, `poses` the result of a solve, and `human` the humanoid model.
"""
