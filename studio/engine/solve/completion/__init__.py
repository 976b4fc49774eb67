"""Completion (step 8) of joints that the cameras do not measure: `relax` (pose), `look_at` (head), `hands` (fingers),
`floor` (feet).
"""
