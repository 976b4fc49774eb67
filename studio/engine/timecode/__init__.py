"""Timecode: numbers of frames (`timecode`), their carriers (`ltc`, `mtc`, `artnet`), and their `course`."""
