"""Mending of cameras' frames around pins, before anything is solved.

around.py    the cameras' joints around some pins, at even instants, with left and right corrected
floor.py     how far the solve will raise the take: pins are on its floor
sides.py     which cameras have left and right exchanged
middle.py    the common path of what several cameras see
evidence.py  evidence of an error: lengths of bones, jumps, distance from the pin
shifts.py    errors that are a shift of some joints
names.py     errors that follow the names that a camera gives, not the body
interval.py  begin, end and size of an error of cameras that contradict a pin
spread.py    the path of a joint while only its pins are known
habit.py     prediction of a joint from the rest of its limb, learnt from other times and the other side
changed.py   frames with joints moved or left out
pinned.py    pins of one joint, and the cameras' joints around them
told.py      findings of pins, as a solve reports them
frames.py    all frames after edits
"""
