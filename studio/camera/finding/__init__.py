"""Devices that are plugged into this machine, and their pictures.

A short process does both: a device's library may hang or crash, and only the end of its process is sure to free its
devices.
"""
