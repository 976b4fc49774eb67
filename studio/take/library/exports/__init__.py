"""Exports of a take for other programs: solves, props and depth."""
