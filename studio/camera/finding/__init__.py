"""Devices that are plugged into this machine, and pictures of what they see.

Both are done by a short process: a device's library may hang or crash, and frees its devices for sure only with its
process.
"""
