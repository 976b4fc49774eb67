"""A MIDI note as a trigger: each press starts or stops the recording.

Source: MIDI 1.0, "Note On": `9n kk vv`, velocity 0 is a release; the status byte may be left out
while it stays the same.
"""

from studio.triggers.command import TriggerCommand

NOTE_ON = 0x90


class NoteDecoder:
    """Finds presses of a note among MIDI bytes.

    Args:
        note: its number, 0 to 127; 60 is the middle C.
    """

    def __init__(self, note: int) -> None:
        self._note = note
        self._status = 0
        self._data: list[int] = []

    def feed(self, data: bytes) -> list[TriggerCommand]:
        """Return a command for each press that these bytes complete."""
        found = []
        for byte in data:
            if byte >= 0xF8:
                continue
            if byte >= 0x80:
                self._status, self._data = byte, []
                continue
            self._data.append(byte)
            if self._status & 0xF0 != NOTE_ON:
                self._data.clear()
            elif len(self._data) == 2:
                note, velocity = self._data
                self._data = []
                if note == self._note and velocity:
                    found.append(TriggerCommand("toggle"))
        return found
