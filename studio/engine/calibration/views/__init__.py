"""Calibration of ordinary cameras (webcams, phones, videos) from one performer's landmarks while he walks.

`calibrate_views` in `calibrate` runs the steps; `seen.view` is the input, `judging.result` the output.
"""
