"""Sources of frames: recordings, videos, depth cameras with a tracker; `registry` lists all."""
