"""Blind A/B tests: two animations side by side, the viewer does not know which is which.

`model` says what a test is, `bake` makes its animations alike in all but the motion, `draw` gives every voter an
order and sides, `store` keeps tests and votes on disk, `desk` runs the tests that are open, `results` counts, with
`statistics`. `thesis` has the pairs of the thesis. No web in here: `studio.api.blind` and `studio.api.vote` do that.
"""
