"""Sizes of the windows in which a whole take is worked on."""

WINDOW = 400
MARGIN = 60
"""Frames of a window, and of the margin on either side."""
