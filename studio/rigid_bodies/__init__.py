"""Incoming rigid bodies from other systems while the stage runs.

`natnet` and `trackers` read packets, `sources` receives them, `settings` defines which are on, and `incoming` keeps
the current pose of each body. Their meaning is defined in `studio/engine/rigid_bodies`.
"""
