"""The performer and the stage: floor, vertical, proportions, T-pose, soles."""
