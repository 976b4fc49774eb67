"""Work on many takes: `jobs` does one take's work, `run` runs jobs on all cores or on a Dask cluster.

A job is idempotent: existing results of the same input and settings are reused, so an interrupted batch can be
continued.
"""
