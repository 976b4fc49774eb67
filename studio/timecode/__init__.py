"""Incoming timecode while the stage runs: LTC as sound, MIDI, Art-Net, the system clock.

`sources` has the possible sources, `sound` reads LTC from files and devices, and `incoming` listens to the chosen
source and returns the current timecode. Numbers and decoders are in `studio/engine/timecode`.
"""
