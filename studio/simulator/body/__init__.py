"""A performer's skinned body for simulated depth cameras (step 1).

The body is defined only here and shares no radius, vertex or bone with the tracker's model, so that the tracker is
measured on bodies it does not know.

`performers` (parameters) -> `mesh` (parts of the body) -> `pose` (bone rotations) -> `skinning`, `cloth` (vertices).
`performer` holds the motion, `sensor` the room, the exact image and the sensors' noise.
"""
