"""Calibration: camera poses, clocks, floor and the performer's proportions from one walking performer.

`calibrate` runs the steps. In `cameras`: `pairs` samples cameras at common instants, `first` finds first clocks from
the motion (`time_offset`) and first transforms (`rigid`), `swaps` corrects left and right, `refine` fits all cameras,
clocks and the depth bias at once (with the noise of `noise`), `merge` makes one skeleton, and `drift` follows the
clocks through the rest of a take. In `performer`: `stage` finds the stage frame (`floor`, `tpose`) and the performer
(`proportions`). In `quality`: `residuals` gives the figures, `handedness` finds mirrored streams, `verdict` judges.

`views` does the same for ordinary cameras, which see no depth.
"""
