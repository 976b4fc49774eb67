"""Depth cameras and other devices: one module each, which imports its SDK only when it is opened.

A module gives `open_<kind>(argument)`: a `DepthSource`, or a `Source` of skeletons where the SDK tracks bodies and
the user asked for it. What could be run without hardware, and what not, is in docs/devices.md.
"""
