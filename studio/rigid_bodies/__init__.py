"""Rigid bodies that come in from other systems while the stage runs.

`natnet` and `trackers` read packets, `sources` receives them, `settings` says which are on, and `incoming` keeps
where each body is now. What they mean is in `studio/engine/rigid_bodies`.
"""
