"""Calibration of ordinary cameras (webcams, phones, videos) from one performer's landmarks while he walks.

`calibrate_views` in `calibrate` runs the steps; `view` is what comes in, `result` what comes out.
"""
