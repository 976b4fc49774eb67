"""Simulated cameras of a client: the embedded performer in real time, as skeletons, depth images or landmarks."""
