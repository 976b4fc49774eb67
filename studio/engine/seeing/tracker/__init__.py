"""The skeleton tracker: a body fitted to depth images, without trained weights.

`view` separates people from floor and background, `person` chooses the performer, `start` finds a first pose,
`fit` tracks it from frame to frame, `limbs` recovers lost limbs, `shape` estimates the performer's proportions.
`body` is one followed body, `shares` divides clusters between several, `newcomers` finds people who come in.
`tracker` runs them, from depth images to skeletons.
"""
