"""Contacts in a finished take, and parts that must not overlap: feet, the floor, the body, other performers.

`contacts` finds standing feet, `places` where they stand, `soles` puts the take on the floor. `body_contact` keeps
parts of one body apart, `others` several bodies, and `between` makes two performers meet where an operator says so.
"""
