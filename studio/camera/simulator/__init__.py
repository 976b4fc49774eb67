"""Simulated cameras: a rig, and the errors of a tracker, over a known motion."""
