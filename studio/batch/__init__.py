"""Many takes at once: `jobs` says what is done to one take, `run` does it on all cores or on a Dask cluster.

A job is idempotent: what it would make and already is there, of the same input and settings, is left alone, so that a
batch that was broken off goes on where it was.
"""
