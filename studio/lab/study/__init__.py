"""The thesis's experiments repeated: many solves of simulated takes, measured and compared with the thesis's figures.

`plan` lists recordings and solves, `cell` makes one recording and its solves, `run` makes all of them on every
core. `thesis_tables` holds the thesis's figures, `results` the means and intervals, `tables` joins both, `votes`
reads blind tests, `decision` is table 6.1, `words` compares both in words, `page` writes the report.
"""
