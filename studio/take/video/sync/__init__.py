"""When the videos of one performance began: `find_sync` in `find` brings them to one clock.

By their sound (`sound` reads it, `sound_delay` compares it), by a clap in it (`clap`), or by `timecode`.
"""
