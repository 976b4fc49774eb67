"""The health of takes.

`doctor` checks and repairs, `recovery` saves takes after a crash, `install` checks the program.
"""
