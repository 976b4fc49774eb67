"""Importers of Kinect v2 skeletons as CSV: `pair` of several sensors, with `people`, and `states` of one.

`joint_set` defines the sensor's joints and axes.
"""
