"""Joints from cameras that see no depth (step 3).

`guess` places a body by one picture alone, `rays` puts the joints of all cameras on their rays, and `triangulation`
finds the points that fit rays and points best.

In: joints in pictures, the cameras' calibrations. Out: joints in the stage frame.
"""
