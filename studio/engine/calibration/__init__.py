"""Calibration: camera poses, clocks, floor and the performer's proportions from one walking performer.

`result` holds what a calibration is (and its JSON); `calibrate` finds it, step by step:
`pairs` brings cameras to common instants, `time_offset` finds first clocks from the motion, `rigid` first
transforms (`first` does both), `swaps` puts left and right in order, `refine` fits all cameras, clocks and the depth
bias at once (with the noise of `noise`), `merge` makes one skeleton, `stage` the stage frame (`floor`, `tpose`) and
the performer (`proportions`), `quality` the figures, `handedness` finds mirrored streams, `verdict` judges.
`drift` then follows the clocks through the rest of a take.
"""
