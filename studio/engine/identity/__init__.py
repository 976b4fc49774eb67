"""Identities (between steps 3 and 5): the performer of each body in a camera's frame.

`person` predicts a person's joints, and `crowd` assigns a frame's bodies to persons. `whole_take` does so for a take
and separates performers from bystanders, after `settle` has undone exchanges. `known` and `recognised` hold what the
live stage takes and returns about persons.
"""
