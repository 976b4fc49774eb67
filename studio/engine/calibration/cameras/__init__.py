"""Cameras relative to each other: pairs of joints, clocks, left and right, transforms, and their refinement."""
