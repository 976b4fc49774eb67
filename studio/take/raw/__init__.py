"""The raw recording of a take, `raw.mcap`, which never changes once its take has ended.

`writer` writes it, `append` continues it, `reader` reads it, damaged or not; `frames` and `depth` return camera
frames and images from it; `live_log` holds the events that make `solve --as-live` exact.
"""
