"""Who is who (between steps 3 and 5): which body in a camera's frame is which performer.

`person.py` expects where a person's joints are, `crowd.py` gives a frame's bodies to persons, `whole_take.py` does so
for a take and tells performers from bystanders.
"""
