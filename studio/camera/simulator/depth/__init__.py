"""A performer's skinned body in a room, seen by depth cameras with the noise of real ones (step 1).

The body is made here and nowhere else: no radius, vertex or bone of the tracker's model is known to it, so that
the tracker is measured on bodies that are not its own.

`performers` (who) -> `body` (mesh) -> `motion` (pose over time) -> `skinning`, `cloth` (vertices) ->
`raster`, `room` (exact depth) -> `sensors`, `structured_light`, `time_of_flight`, `stereo` (what a sensor makes
of it) -> `camera` (all of it) -> `recording`, `source` (takes, live).
"""
