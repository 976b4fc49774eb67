"""Humanoid robots as characters: read, measured, kept, and moved by a performer's poses.

`reading` opens MJCF and URDF files, `parts` finds the parts of the body, `robot` measures them, `files` keeps robots.
`performed` describes a performer's motion, `targets` scales it to a robot. `whole_take` solves all frames at once,
`live` one after the other, `per_frame` as other tools do. `figures` judges a motion, `motion` writes it.
"""
