"""Speed of the stages.

`simulator.demo` makes the input, `timing` measures, `stages` and `plain_mink` are measured, `run` runs everything.
"""
