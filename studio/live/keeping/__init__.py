"""Protection of frames: frames that clients keep, frames that arrive late, takes that a crash interrupted."""
