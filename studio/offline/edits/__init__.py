"""What edits of a take lead to.

around.py, first_look.py   the surroundings of an edit, solved first
offers.py, offered.py      what to mend in a solve, and the edits that would mend it
mend.py                    offered edits, tried and kept where they mend
splicing.py, take_parts.py takes that are spliced from parts of others
"""
