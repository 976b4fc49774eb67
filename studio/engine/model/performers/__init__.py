"""Choices for performers.

`colours` of their figures, `bodies` of the mannequin, and `exchange`, the operator's correction of identities.
"""
