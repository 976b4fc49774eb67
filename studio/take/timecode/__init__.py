"""The timecode of a take: the readings that were recorded with it, on its stage clock."""
