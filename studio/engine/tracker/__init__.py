"""The skeleton tracker: a body fitted to depth images, without trained weights.

`view` finds what stands before floor and background, `person` chooses the performer, `start` finds a first pose,
`fit` follows it from frame to frame, `limbs` finds lost limbs again, `shape` learns the performer's proportions.
`tracker` is the whole: depth images in, one skeleton out.
"""
