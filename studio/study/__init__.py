"""The thesis's experiments again: many solves of simulated takes, measured, beside the thesis's own figures.

`plan` says what is recorded and solved, `cell` does one recording and its solves, `run` does all of them on every
core. `thesis_tables` holds the thesis's figures, `results` the means and intervals, `tables` joins both, `votes`
reads blind tests, `decision` is table 6.1, `words` says where both agree and why not, `page` writes it all down.
"""
