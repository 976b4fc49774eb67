"""Measurement of the studio itself: `bench` for speed, `study` for the experiments of the thesis."""
