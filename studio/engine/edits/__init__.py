"""Edits of a take: what an operator says about it, as evidence for its solves."""
