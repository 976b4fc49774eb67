"""Skeletons with a tracker's errors: noise, hidden joints, interference."""
