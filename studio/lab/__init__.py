"""Measurement of the studio itself: `bench` its speed, `study` the experiments of the thesis."""
