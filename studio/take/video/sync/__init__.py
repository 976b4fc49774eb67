"""Start times of the videos of one performance: `find_sync` in `find` brings them to one clock.

It uses their sound (`sound` reads it, `sound_delay` compares it), a clap in it (`clap`), or `timecode`.
"""
