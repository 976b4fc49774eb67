"""Blind A/B tests: two animations side by side; the viewer does not know which is which.

`model` defines a test, `bake` makes animations that differ in the motion only, `draw` gives every voter an
order and sides, `store` keeps tests and votes on disk, `desk` runs the open tests, and `results` counts, with
`statistics`. `thesis` has the pairs of the thesis. The HTTP side is in `blind` and `vote` of `studio.api.sharing`.
"""
