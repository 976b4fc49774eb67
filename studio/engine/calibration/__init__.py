"""Calibration: camera poses, clocks, floor and the performer's proportions from one walking performer.

`result` holds what a calibration is (and its JSON); `calibrate` finds it, step by step:
`pairs` gathers joints of two cameras at common instants, `time_offset` finds clocks from the motion,
`rigid` the transforms, `floor` floor and up, `proportions` the performer.
"""
