"""Importers of Kinect v2 skeletons as CSV: `pair` of several sensors, with `people`, and `states` of one.

`joint_set` says what the sensor's joints are and how its axes lie.
"""
