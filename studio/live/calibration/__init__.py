"""The calibration in use: stored on disk, computed, checked, with its performers."""
