"""Triggers: other programs start and stop recordings, and hear of them.

In come `CaptureStart`/`CaptureStop` as XML over UDP (`capture_xml`), OSC (`osc`) and MIDI notes (`midi_note`), heard
by `listeners`; `operator` decides what each does. Out go the same XML, OSC answers and HTTP webhooks (`tellers`).
`triggers` holds them together, `settings` says which are on.
"""
