"""Triggers: other programs start and stop recordings, and are notified of them.

`listeners` receive `CaptureStart`/`CaptureStop` as XML over UDP (`capture_xml`), OSC (`osc`) and MIDI notes
(`midi_note`); `operator` decides what each does. The studio sends the same XML, OSC answers and HTTP webhooks
(`tellers`). `triggers` combines them, `settings` defines which are on.
"""
