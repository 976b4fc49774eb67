"""Simulated cameras: a rig that watches a known motion, with a tracker's or a sensor's errors."""
