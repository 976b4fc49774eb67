"""Sources of frames: recordings, simulated cameras, depth cameras with a tracker; `registry` lists all."""
