"""Depth cameras and other devices: one module each, which imports its SDK only when it is opened.

A module gives a configuration, which opens a `DepthSource`, or a `Source` of skeletons if the SDK tracks bodies
and the user asked for it. docs/devices.md lists which parts were run without hardware.
"""
