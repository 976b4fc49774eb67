"""Timecode that comes in while the stage runs: LTC as sound, MIDI, Art-Net, the system clock.

`sources` has what can be listened to, `sound` reads LTC from files and devices, and `incoming` listens to the chosen
one and says what timecode it is now. Numbers and decoders are in `studio/engine/timecode`.
"""
