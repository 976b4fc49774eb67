"""Whole takes (step 11): all frames through the pipeline, and finishing with past and future frames.

`take` runs them, `collect` keeps the poses, `trace` their inputs, `residuals` the joints that the pose does not
follow. `finisher` runs `finish` (least squares over all frames) and, if set, `physics`.
"""
