"""Who is who (between steps 3 and 5): which body in a camera's frame is which performer.

`person` expects where a person's joints are, `crowd` gives a frame's bodies to persons. `whole_take` does so for a
take and tells performers from bystanders, after `settle` has given back who was exchanged. `known` and `recognised`
are what the live stage says and hears of persons.
"""
