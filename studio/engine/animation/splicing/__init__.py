"""Poses combined in time: spliced takes, looped ranges, retimed parts."""
