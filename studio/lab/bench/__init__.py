"""Speed of the stages.

`stage` makes the input, `timing` measures, `stages` and `plain_mink` are measured, `run` runs everything.
"""
