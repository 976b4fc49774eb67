"""What touches in a finished take, and what must not pass through: feet, the floor, the body, other performers.

`contacts` finds standing feet, `places` where they stand, `soles` puts the take on the floor. `body_contact` keeps
parts of one body apart, `others` several bodies, and `between` has two performers meet where an operator says so.
"""
