"""Mending of cameras' frames around pins, before anything is solved.

around.py    the cameras' joints around some pins, at even instants, with left and right as they are
floor.py     how far the solve will raise the take: pins are on its floor
sides.py     which cameras have left and right exchanged
middle.py    the common path of what several cameras see
evidence.py  what tells of an error: lengths of bones, jumps, distance from the pin
shifts.py    errors that are a shift of some joints
names.py     errors that follow the names that a camera gives, not the body
interval.py  from when to when cameras contradict a pin, and by how much
spread.py    the path of a joint while nothing is known of it but pins
habit.py     where a joint is by what the rest of its limb does, as at other times and on the other side
changed.py   frames with joints put elsewhere, or left out
pinned.py    what pins of one joint say, and what cameras see around them
told.py      what pins found, as a solve tells it
frames.py    all frames as edits leave them
"""
