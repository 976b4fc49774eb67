"""Speed of the stages.

`stage` makes the input, `timing` measures, `stages` and `plain_mink` are what is measured, `run` does it all.
"""
