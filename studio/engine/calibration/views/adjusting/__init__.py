"""The bundle adjustment of all cameras at once, its cameras, and left and right in their pictures."""
