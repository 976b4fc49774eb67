"""Timecode: numbers of frames (`timecode`), what carries them (`ltc`, `mtc`, `artnet`), and their `course`."""
