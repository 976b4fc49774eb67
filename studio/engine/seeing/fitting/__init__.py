"""The body fitted to points: its surface (`cones`), its chain, its fit, its shape, and the confidence of each
joint."""
