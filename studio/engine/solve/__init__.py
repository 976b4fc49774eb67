"""The solve of one instant, for live and replay (steps 3 to 9).

Live, `people` has a `pipeline` for each performer. It runs the solve: `timing` aligns the cameras' frames, `fusion`
makes one skeleton, `conditioning` limits and filters, `kalman` or `ik` solves the humanoid, `completion` adds joints
that no camera sees, `uncertainty` estimates the error.
"""
