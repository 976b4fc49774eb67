"""Edits of a take: an operator's statements about it, as evidence for its solves."""
